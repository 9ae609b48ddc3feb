// The least and the greatest value around diamonds and all their descendants: they tell what a range needs.
//
// A diamond and its child share the value at the diamond's centre, so the values around a diamond and its descendants
// lie on both sides of a bound if and only if those around one of them do. So a diamond is relevant to a range (it counts
// for it, as in front.h, or a descendant does) if and only if its bounds say so, whatever the range.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/diamond/supercube.h"
#include "common/ivm/paged_values.h"
#include "common/ivm/value_keys.h"
#include "common/patch/key_sides.h"
#include "common/util/parallel.h"

namespace intervale {

// What counts for a range, of the keys around a diamond.
class CountingKeys {
 public:
  CountingKeys(const KeySides& sides, Refine refine) : sides_(sides), refine_(refine) {}
  [[nodiscard]] bool operator()(ValueKey least, ValueKey greatest) const {
    const Side low = sides_.side(least);
    return low != sides_.side(greatest) || (refine_ == Refine::uniform && low == Side::inside);
  }

 private:
  KeySides sides_;
  Refine refine_;
};

// Immutable.
class ValueBounds {
 public:
  // The set holds with each diamond all its ancestors. Takes two keys a diamond of memory meanwhile.
  explicit ValueBounds(const PagedValues& values, const ParallelFor& parallel = serial);

  // Whether a brick has diamonds that are relevant.
  [[nodiscard]] bool is_relevant(const CountingKeys& counts, BrickIndex b) const { return counts(brick_least_[b], brick_greatest_[b]); }
  // Whether a supercube has diamonds that are relevant.
  [[nodiscard]] bool is_relevant(const CountingKeys& counts, SupercubeIndex s) const { return counts(supercube_least_[s], supercube_greatest_[s]); }
  // Whether a diamond of scale 1 or coarser is relevant.
  [[nodiscard]] bool is_relevant(const CountingKeys& counts, UpdateIndex i) const { return counts(least_[i], greatest_[i]); }

  [[nodiscard]] std::size_t memory_bytes() const {
    return least_.memory_bytes() + greatest_.memory_bytes() + supercube_least_.memory_bytes() + supercube_greatest_.memory_bytes() +
           brick_least_.memory_bytes() + brick_greatest_.memory_bytes();
  }

 private:
  ValueKeys least_, greatest_;                      // by number, of scale 1 or coarser
  ValueKeys supercube_least_, supercube_greatest_;  // of all its diamonds, by supercube
  ValueKeys brick_least_, brick_greatest_;          // of all its diamonds, by brick
};

}  // namespace intervale
