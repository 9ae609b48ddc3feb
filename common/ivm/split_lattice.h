// The keys of split diamonds at the points of a lattice around one supercube: from them follow the diamonds that can be
// split next, and the keys at their vertices. All that a server knows of a client's mesh.
//
// In units of h, a supercube has points from 0 to 3 on each axis, and the vertices of its diamonds lie from -1 to 4.
// Those with even coordinates only are points of the next coarser supercube's lattice, so that each supercube is loaded
// from that lattice and from a few neighbours of the same scale.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/codec/value_prediction.h"
#include "common/diamond/parent_table.h"
#include "common/diamond/split_set.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/interval_volume.h"

namespace intervale {

class SplitLattice {
 public:
  // All diamonds of the volume, which must outlive it, are split.
  explicit SplitLattice(const IntervalVolume& volume) : SplitLattice(volume, nullptr) {}
  // Both must outlive it. split: must not change. What it says is about a client only if that is closed under parents.
  SplitLattice(const IntervalVolume& volume, const SplitSet& split) : SplitLattice(volume, &split) {}

  // Fastest along ascending keys.
  void move_to(SupercubeKey key);
  // The same, without a lookup of the supercube. group: of one in the volume.
  void move_to(const SlotGroup& group);

  // Which of these slots of the supercube hold diamonds that exist, whose split would not be a no-op, and whose parents
  // are split, whether they are split themselves or not.
  [[nodiscard]] std::uint64_t splittable(std::uint64_t slots);

  // The keys at the vertices of a diamond that splittable() has named since the last move, and their span. Vertices
  // that do not exist get what fill_missing() gives them. Class: of the diamond.
  template <int Class>
  KeySpan gather(Slot slot, VertexKeys& keys) const {
    const auto& vertex = tables_.vertex[slot];
    keys[0] = keys_[vertex[0]];
    KeySpan span{keys[0], keys[0]};
    for (std::size_t v = 1; v < kVerticesOfClass[Class]; ++v) {
      keys[v] = keys_[vertex[v]];
      span.add(keys[v]);
    }
    if ((border_ >> slot & 1) == 0) return span;
    replace_missing(slot, keys);
    return span_of<Class>(keys);
  }

 private:
  SplitLattice(const IntervalVolume& volume, const SplitSet* split);
  static constexpr int kSide = 6;  // points on an axis, from -1 to 4
  static constexpr std::int32_t point_of(int x, int y, int z) { return ((z + 1) * kSide + y + 1) * kSide + x + 1; }
  using Point = std::uint8_t;
  // The places of a ParentTable, as neighbours.
  static constexpr std::array<unsigned, ParentTable::kPlaces> kParentNeighbour{0, 1, 2, 4};
  using Keys = std::array<ValueKey, kSide * kSide * kSide>;  // kNoKey where no split diamond has its centre
  // By slot: the point of the centre, those of the vertices and those of the parents; unused ones repeat the first. By
  // neighbour, a bit for each axis: its slots that lie in a lattice, if it lies behind the supercube and if ahead.
  struct Tables {
    std::array<Point, kSlots> centre{};
    std::array<std::array<Point, kMaxVertices>, kSlots> vertex{};
    std::array<std::array<Point, kMaxParents>, kSlots> parent{};
    std::array<std::array<std::uint8_t, kMaxParents>, kSlots> parent_vertex{};  // its local number
    std::array<std::uint64_t, 8> behind{}, ahead{};
    std::array<std::array<std::uint64_t, 4>, 3> at{};  // by axis and coordinate of the centre: slots
    std::array<std::uint64_t, 8> users{};              // by neighbour behind: slots of diamonds with a vertex in it
  };
  [[nodiscard]] static Tables make_tables();
  [[nodiscard]] static const Tables& tables();

  // The lattice of a coarser supercube: points from 0 on. Its neighbours ahead are loaded as they are needed.
  struct Coarser {
    SetFinder finder;
    Vertex position{-1, -1, -1};
    unsigned loaded = 0;  // neighbours, a bit each
    Keys keys{};
  };
  const Keys& coarser(int scale, Vertex position, unsigned half);
  void load_coarser(int scale, Vertex position, Keys& keys);
  void place_at(SupercubeKey key);
  void load_behind();
  std::uint64_t load_neighbour(SetFinder& finder, const SupercubePlace& from, unsigned neighbour, int towards, Keys& keys);
  std::uint64_t load_slots(const SetFinder::Found& found, std::uint64_t used, ValueKey* first) const;
  template <unsigned Width>
  void load_keys(const SetFinder::Found& found, std::uint64_t slots, ValueKey* first) const;
  std::uint64_t splittable_inside(std::uint64_t slots) const;
  std::uint64_t splittable_at_border(std::uint64_t slots);
  void replace_missing(Slot slot, VertexKeys& keys) const;

  const Tables& tables_ = tables();
  const IntervalVolume& volume_;
  const SplitSet* split_;         // nullptr: all
  std::vector<Coarser> coarser_;  // by scale; beyond the coarsest one, the corners of the domain
  SetFinder finder_;
  SupercubePlace place_;  // of the supercube
  bool is_interior_ = false;
  ParentTable::Words parents_{};               // split slots of classes 0 and 1
  std::uint64_t border_ = 0;                   // slots of diamonds that reach the border of the box, or beyond
  std::array<std::uint32_t, kSlots> exist_{};  // of those: the vertices that exist, a bit each
  Keys keys_{};
};

}  // namespace intervale
