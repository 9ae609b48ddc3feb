// The diamonds that are relevant to a range (Weiss and De Floriani 2008, section 6), by brick; and how far surfaces move
// there, roughly.
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

class SplitLattice;

// What counts for the range, and all ancestors of that; without those whose values are lost (page_faults.h). Of scale 1
// and coarser, the bounds of values tell. Of scale 0, a diamond is relevant if it or a descendant of the same scale
// counts; whether it counts itself is found once for each brick and kept, since the bricks before it need it, too. Any
// thread.
class RelevantSlots {
 public:
  // The volume was refined uniformly, and must outlive it. The first of a volume takes O(updates): IntervalVolume::bounds().
  RelevantSlots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel = serial);

  // By supercube of the brick, in order. Some 30 microseconds of scale 0 where the surface is, otherwise a few.
  [[nodiscard]] std::vector<std::uint64_t> of(BrickIndex brick) const;
  // How far diamonds that count move the surface at most, by supercube of the brick, in widths of its diamonds: by the
  // diamond's error over the steepness of the values around it, and by 1 at most; by 1 where only its centre lies on
  // another side. An estimate; 0 if none has an error. The range has one surface.
  [[nodiscard]] std::vector<float> moves(BrickIndex brick) const;
  // Whether a brick has any at all.
  [[nodiscard]] bool has_any(BrickIndex brick) const { return bounds_.is_relevant(counts_, brick); }

 private:
  using Words = std::vector<std::uint64_t>;  // by supercube of a brick
  [[nodiscard]] Words of_coarse(BrickIndex brick) const;
  [[nodiscard]] Words of_fine(BrickIndex brick) const;
  struct Counting {
    Words words;               // by supercube of a brick; empty: none
    std::vector<float> moves;  // likewise
  };
  [[nodiscard]] Counting find_counting(BrickIndex brick) const;
  template <int Class>
  UpdateIndex add_counting(const SplitLattice& lattice, std::uint64_t occupancy, UpdateIndex next, Counting& counting) const;
  [[nodiscard]] const Counting& counting(BrickIndex brick) const;

  const IntervalVolume& volume_;
  const SupercubeSet& set_;
  const ValueBounds& bounds_;
  CountingKeys counts_;
  BrickIndex first_fine_;                 // bricks of scale 0 are the last
  mutable LazyArray<Counting> counting_;  // by brick of scale 0
};

}  // namespace intervale
