// The data of a front: the split diamonds by supercube, their values or cuts, and counts.
//
// Weiss and De Floriani 2008, sections 6 and 7. In the paper each diamond of the front holds its vertices and edges,
// and a split hands each child its duet. Here what a split brought (the side of the centre, the cuts on the subdivision
// edges) stays with the split diamond, supercube by supercube, and a diamond gathers its vertices and edges from its
// ancestors' splits (supercube_neighbours.h). A split then writes eight bytes and its cuts, a merge clears one bit, and
// the front itself is implied.
//
// A front is split by cuts or by values. One that is split by values has FrontState::values. It keeps the key of the
// value at each split diamond's centre, and derives sides and cuts from the keys. Only shown splits have cuts and
// points, so that a front may hold far more than it shows.
//
// Invariants, which Front keeps and Front::validate checks:
//   1. Of each split diamond, all parents that exist are split; of each shown one, all are shown. shown is a subset of
//      split.
//   2. A split, or by values a shown split, has the cuts that its side and its diamond's vertices call for.
//   3. index has the number of each block under its scale and position, and no other. A block stays where it is until
//      pack().
//   4. The counters are those of the splits and of the mesh that the shown ones make.
//   5. Split by values: what is shown and does not count for the range has a child whose split is shown. If no split
//      that counts is hidden and the mesh is not limited, every split with a shown child is shown. A child is one by
//      its place, whether it was handed tetrahedra or not.
#pragma once

#include <array>
#include <bit>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"
#include "common/diamond/grid.h"
#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/front/slot_array.h"
#include "common/patch/description.h"
#include "common/patch/key_sides.h"
#include "common/patch/range.h"
#include "common/patch/value_format.h"

namespace intervale {

// A point of the mesh: a cut, or a centre inside the range. It stays the same until the front forgets splits
// (FrontState::point_generation).
using PointId = std::uint32_t;

// Numbers of the neighbours of one supercube that were found before; it fills up while readers look. Thread rule: any
// number of threads may read and store at the same time while no block is added or removed. An entry is one word that
// is loaded and stored atomically (relaxed), all threads store the same value, and a thread that does not see it
// yet searches again; nothing else is published by it.
class NeighbourCache {
 public:
  static constexpr std::uint32_t kUnknown = 0;
  // The number of the block, and 1; or kUnknown. where: below kFiner.
  [[nodiscard]] std::uint32_t load(int where) const { return __atomic_load_n(&number_[std::size_t(where)], __ATOMIC_RELAXED); }
  void store(int where, std::uint32_t number) const { __atomic_store_n(&number_[std::size_t(where)], number, __ATOMIC_RELAXED); }

 private:
  // No std::atomic, which cannot be copied; no std::atomic_ref, which Emscripten lacks
  mutable std::array<std::uint32_t, kFiner> number_{};
};

// What the values of a front mean, and the range that its mesh is made for.
struct FrontValues {
  FrontValues(const ValueFormat& of, const Range& kept, Refine how) : format(of), range(kept), refine(how), sides(of, kept) {}
  ValueFormat format;
  Range range;
  Refine refine;
  KeySides sides;              // of format and range
  std::uint64_t withheld = 0;  // split diamonds that count for the range, but are hidden
  bool is_limited = false;     // a split that has a shown child was hidden, for want of room
  // Whether the mesh is all that the rule says (Front).
  [[nodiscard]] bool is_complete() const { return withheld == 0 && !is_limited; }
};

struct FrontState {
  // A split, as bits: 2 v for a cut of alpha on the edge from the centre to local vertex v, 2 v + 1 for one of beta;
  // above them the centre's side.
  static constexpr int kSideBit = 2 * kMaxVertices;
  static constexpr std::uint32_t kCutBits = (1u << kSideBit) - 1;
  struct Split {
    std::uint32_t bits = 0;
    // Of its cuts, in order of their bits; if the centre is inside, that is the point after the last one
    PointId first = 0;
    [[nodiscard]] Side side() const { return Side(bits >> kSideBit); }
    [[nodiscard]] std::uint32_t cut_bits() const { return bits & kCutBits; }
    [[nodiscard]] PointId cut(int bit) const { return first + PointId(count_below(bits, bit)); }
    [[nodiscard]] PointId centre() const { return first + PointId(std::popcount(cut_bits())); }
    [[nodiscard]] std::uint32_t points() const { return centre() - first + (side() == Side::inside); }
    // The sides of the diamond's vertices, as DiamondContext has them; pairs: DiamondContext::pairs.
    [[nodiscard]] std::uint32_t vertex_sides(std::uint32_t pairs) const {
      const std::uint32_t alpha = bits & pairs, beta = bits >> 1 & pairs;
      if (side() == Side::below) return (alpha & ~beta) | beta << 1;
      if (side() == Side::inside) return (pairs & ~(alpha | beta)) | beta << 1;
      return (beta & ~alpha) | (pairs & ~beta) << 1;
    }
    // Which of the two surfaces cut the edge to local vertex v: bit 0 alpha, bit 1 beta.
    [[nodiscard]] unsigned cuts_to(int v) const { return bits >> (2 * v) & 3; }
  };
  // All that is known of one supercube.
  struct Block {
    Vertex position;  // centre >> (scale + 2)
    std::int32_t scale = 0;
    std::uint64_t split = 0;  // slots
    std::uint64_t shown = 0;  // those of `split` that the mesh is made with; the others are hidden
    // Of a front split by values: the sides of the centres of those of `split`; which of them count for the range; and
    // which slots have points
    std::uint64_t inside = 0, above = 0, counts = 0, placed = 0;
    // Bounds of the keys at the centres and the vertices of the diamonds that are split, or were
    ValueKey least = ~ValueKey(0), greatest = 0;
    NeighbourCache neighbours;
    SlotArray<Split> of;  // of those split; by values: of those placed
    SlotKeys key;         // of those split, or were, if by values
    [[nodiscard]] bool is_split(Slot slot) const { return (split >> slot & 1) != 0; }
    [[nodiscard]] bool is_shown(Slot slot) const { return (shown >> slot & 1) != 0; }
    [[nodiscard]] bool is_counting(Slot slot) const { return (counts >> slot & 1) != 0; }
    [[nodiscard]] Side side(Slot slot) const { return Side((inside >> slot & 1) | (above >> slot & 1) << 1); }
    void set_side(Slot slot, Side side) {
      inside = (inside & ~(std::uint64_t(1) << slot)) | std::uint64_t(side == Side::inside) << slot;
      above = (above & ~(std::uint64_t(1) << slot)) | std::uint64_t(side == Side::above) << slot;
    }
  };
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  explicit FrontState(const Grid& of) : grid(of), domain(of.dims) {}

  // The number of a supercube's block, or kNone.
  [[nodiscard]] std::uint32_t find_number(int scale, Vertex position) const;
  // Or null.
  [[nodiscard]] const Block* find_block(int scale, Vertex position) const {
    const std::uint32_t number = find_number(scale, position);
    return number == kNone ? nullptr : &blocks[number];
  }
  Block& obtain_block(int scale, Vertex position);
  [[nodiscard]] std::span<const std::uint8_t> cuts_of(const Split& split) const {
    return std::span(q).subspan(split.first, split.centre() - split.first);
  }
  [[nodiscard]] bool is_root_block(const Block& block) const { return block.scale == domain.levels(); }
  [[nodiscard]] std::size_t memory_bytes() const;
  // Removes blocks without splits and cuts that belong to no split, or by values to none that is shown. Blocks move,
  // and points get other numbers.
  void pack();

  Grid grid;
  Domain domain;
  std::optional<FrontValues> values;  // of a front split by values
  // The first has the domain's corners but (0, 0, 0), as diamonds of scale `levels`
  std::deque<Block> blocks;
  boost::unordered_flat_map<std::uint64_t, std::uint32_t> index;  // of blocks
  Block origin;                                                   // the domain's corner (0, 0, 0): slot 0
  // By PointId: of each cut its q (see Cuts); unused for a centre
  std::vector<std::uint8_t> q;
  std::uint64_t tet_count = 0, split_count = 0, shown_count = 0;
  std::uint64_t point_generation = 0;  // how often points got other numbers
};

}  // namespace intervale
