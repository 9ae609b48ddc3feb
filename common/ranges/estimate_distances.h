// From errors to distances, estimated: for a range that was just chosen, until error_to_distance.h has measured them.
#pragma once

#include <cstdint>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"

namespace intervale {

// By supercube. A surface moves by the error of the diamond that it crosses over the steepness of the values around it,
// and by the diamond's width at most; where only the diamond's centre lies on the other side, by the width. For half of
// the supercubes of scale 0 within a factor of 2 of what is measured, for 99 % no more than 32 times too large; coarser
// ones are mostly too small. slots: relevant ones by supercube, of a volume that was refined uniformly.
[[nodiscard]] std::vector<ErrorToDistance> estimate_distances(const IntervalVolume& volume, const Range& range,
                                                              const std::vector<std::uint64_t>& slots, const ParallelFor& parallel = serial);

}  // namespace intervale
