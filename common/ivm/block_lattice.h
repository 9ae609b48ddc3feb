// The values around the diamonds of one block, at the points of a lattice.
//
// A block is the diamonds of one scale whose centres share the bits above the lowest six, in units of h = 2^scale: 64 x
// 64 x 64 points of the lattice of spacing h, 16 x 16 x 16 supercubes. Every vertex of those diamonds is a point of the
// lattice from -1 to 64. Points with even coordinates only are of coarser scales; the others at -1 belong to
// neighbouring blocks.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/codec/value_prediction.h"
#include "common/diamond/supercube.h"
#include "common/ivm/paged_values.h"

namespace intervale {

// A block's name: the part that its supercubes' keys share. Ascending along with them.
using BlockKey = std::uint64_t;
inline constexpr int kBlockBits = 12;  // of a supercube's key, that tell supercubes of one block apart
[[nodiscard]] constexpr BlockKey block_of(SupercubeKey key) { return key >> kBlockBits; }

// The bricks [first, end) of a set.
struct BrickRun {
  BrickIndex first, end;
};
// The blocks of a set, ascending.
[[nodiscard]] std::vector<BrickRun> blocks_of(const SupercubeSet& set);

// Where a block is: in blocks of its scale, not negative.
struct BlockPlace {
  int scale = 0;
  Vertex at;
};
[[nodiscard]] inline BlockPlace place_of(BlockKey block) {
  const SupercubeKey key = block << kBlockBits;
  const Vertex p = position_of_key(key);
  return {scale_of_key(key), {p.x >> 4, p.y >> 4, p.z >> 4}};
}
[[nodiscard]] inline BlockKey block_at(const BlockPlace& place) {
  return block_of(supercube_key(place.scale, {place.at.x << 4, place.at.y << 4, place.at.z << 4}));
}

// Calls visit(block) for the blocks of coarser scales, whether or not they exist, that may have vertices of a block's
// diamonds: those lie at 0 to 64 in units of the block's scale, in up to 8 blocks of each.
template <class Visit>
void for_each_coarser_block(BlockKey block, Visit&& visit) {
  constexpr int kBlockShift = 6;
  const BlockPlace place = place_of(block);
  for (int coarser = place.scale + 1; coarser < kMaxLevels; ++coarser) {
    const int shift = kBlockShift + coarser - place.scale;
    const auto first = [shift](std::int32_t p) { return (p << kBlockShift) >> shift; };
    const auto last = [shift](std::int32_t p) { return ((p + 1) << kBlockShift) >> shift; };
    for (std::int32_t z = first(place.at.z); z <= last(place.at.z); ++z) {
      for (std::int32_t y = first(place.at.y); y <= last(place.at.y); ++y) {
        for (std::int32_t x = first(place.at.x); x <= last(place.at.x); ++x) visit(block_at({coarser, {x, y, z}}));
      }
    }
  }
}

class BlockLattice {
 public:
  static constexpr int kSide = 66;  // points on an axis, from -1 to 64

  // What the values refer to must outlive it; the keys may change.
  explicit BlockLattice(const PagedValues& values);

  enum class Load {
    coarser,  // the points of coarser scales
    own,      // and those of the block
    all,      // and those of its neighbours at -1
  };
  // Sets the points that exist; all others become kNoKey.
  void move_to(BlockKey block, Load load);

  // A point's number, from its coordinates in the block, -1 to 64. at(): of the first point of one of the block's
  // supercubes; of_slot(): a diamond's centre, and its vertices, from there.
  using Point = std::int32_t;
  static constexpr Point point_of(std::int32_t x, std::int32_t y, std::int32_t z) { return ((z + 1) * kSide + y + 1) * kSide + x + 1; }
  [[nodiscard]] Point at(SupercubeKey key) const;
  [[nodiscard]] static Point of_slot(Slot slot) { return offsets().centre[slot]; }
  // A vertex, from the centre of the diamond.
  [[nodiscard]] static Point to_vertex(Slot slot, int vertex) { return offsets().vertex[slot][std::size_t(vertex)]; }

  [[nodiscard]] ValueKey key(Point point) const { return keys_[std::size_t(point)]; }
  void set_key(Point point, ValueKey key) { keys_[std::size_t(point)] = key; }
  // The keys of a diamond's vertices, or kNoKey: for those that the set lacks, or that are not loaded.
  void gather(Point centre, Slot slot, VertexKeys& keys) const {
    const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
    const auto& offset = offsets().vertex[slot];
    for (std::size_t v = 0; v < row.vertices; ++v) keys[v] = keys_[std::size_t(centre + offset[v])];
  }

 private:
  struct Offsets {
    std::array<Point, kSlots> centre{};
    std::array<std::array<Point, kMaxVertices>, kSlots> vertex{};
  };
  static const Offsets& offsets() {
    static const Offsets table = make_offsets();
    return table;
  }
  static Offsets make_offsets();
  void load_scale(int scale, bool own_only);

  const std::array<ValueKey, kRootVertices>& corners_;
  const SupercubeSet& set_;
  const ValueKeys& values_;
  int levels_, scale_ = 0;
  Vertex first_;  // the block's first point, in units of h
  std::vector<ValueKey> keys_;
};

}  // namespace intervale
