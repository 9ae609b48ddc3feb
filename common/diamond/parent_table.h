// Which diamonds of a supercube lack a parent, eight slots at a time. For classes 1 and 2 inside the box, whose parents
// are of the same scale: in the supercube itself, or in the one before it along an axis.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"

namespace intervale {

class ParentTable {
 public:
  static constexpr std::size_t kPlaces = 4;
  static constexpr std::array<int, kPlaces> kNeighbours{kHere, kHere - 1, kHere - 3, kHere - 9};  // as of Link::where
  using Words = std::array<std::uint64_t, kPlaces>;                                               // slots, by place

  ParentTable();

  // The slots of classes 1 and 2 that lack a parent. split: those that are split, those of classes 0 and 1 at least.
  [[nodiscard]] std::uint64_t lacking(const Words& split) const {
    std::uint64_t slots = 0;
    for (std::size_t place = 0; place < kPlaces; ++place) {
      for (std::size_t byte = 0; byte < kBytes; ++byte) slots |= children_[place][byte][~split[place] >> (8 * byte) & 255];
    }
    return slots;
  }

 private:
  static constexpr std::size_t kBytes = 4;  // of a word: the slots of classes 0 and 1
  // By place, and by eight slots there: the children of those whose bits are set.
  std::array<std::array<std::array<std::uint64_t, 256>, kBytes>, kPlaces> children_{};
};

// The parents of a diamond of class 1 or 2: of classes 0 and 1 of the same scale.
struct ParentSlots {
  struct One {
    Slot slot;
    std::uint8_t place = 0;  // of ParentTable
  };
  std::array<One, kMaxParents> parent{};
  std::size_t count = 0;
};
// By slot; those of class 0 have none here. Computed at first use.
[[nodiscard]] const std::array<ParentSlots, kSlots>& parents_by_slot();

// The table, computed at first use.
[[nodiscard]] const ParentTable& parent_table();

}  // namespace intervale
