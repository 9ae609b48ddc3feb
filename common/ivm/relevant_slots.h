// The diamonds that are relevant to a range (Weiss and De Floriani 2008, section 6), by brick.
#pragma once

#include <cstdint>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/value_bounds.h"
#include "common/patch/shown_range.h"
#include "common/util/lazy_array.h"
#include "common/util/parallel.h"

namespace intervale {

// What counts for a range (front.h) of all updates, by supercube. The volume's set, keys and description must be there. Some
// 20 ns for each update.
[[nodiscard]] std::vector<std::uint64_t> counting_slots(const IntervalVolume& volume, const CountingKeys& counts);

// What counts for the range (front.h): splits that change its mesh, if their ancestors are split. Without those whose
// values are lost (page_faults.h). Any thread.
class RelevantSlots {
 public:
  // The volume was refined uniformly, and must outlive it. The first of a volume takes O(updates): IntervalVolume::bounds().
  RelevantSlots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel = serial);

  // By supercube of the brick, in order. Some 20 microseconds where the surface is.
  [[nodiscard]] std::vector<std::uint64_t> of(BrickIndex brick) const;
  // Likewise, with all ancestors. Of scale 1 and coarser, the bounds of values tell. Of scale 0 it is those of the same
  // scale; what counts is found once for each brick and kept, since the bricks before it need it, too.
  [[nodiscard]] std::vector<std::uint64_t> with_ancestors(BrickIndex brick) const;
  // Whether a brick has any of those at all.
  [[nodiscard]] bool has_any(BrickIndex brick) const { return bounds_.is_relevant(counts_, brick); }

 private:
  using Words = std::vector<std::uint64_t>;  // by supercube of a brick
  [[nodiscard]] Words none(BrickIndex brick) const;
  [[nodiscard]] Words without_lost(BrickIndex brick, Words words) const;
  [[nodiscard]] Words of_coarse(BrickIndex brick) const;
  [[nodiscard]] Words of_fine(BrickIndex brick) const;
  [[nodiscard]] Words find_counting(BrickIndex brick) const;  // empty: none
  [[nodiscard]] const Words& fine_counting(BrickIndex brick) const;

  const IntervalVolume& volume_;
  const SupercubeSet& set_;
  const ValueBounds& bounds_;
  CountingKeys counts_;
  BrickIndex first_fine_;              // bricks of scale 0 are the last
  mutable LazyArray<Words> counting_;  // by brick of scale 0
};

}  // namespace intervale
