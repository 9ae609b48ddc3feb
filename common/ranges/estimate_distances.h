// From errors to distances, estimated: for a range that was just chosen, until error_to_distance.h has measured them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/ivm/interval_volume.h"

namespace intervale {

// By supercube of a brick of a volume that was refined uniformly. moves: of the range (RelevantSlots). slots: the relevant
// ones. For half of the supercubes of scale 0 within a factor of 2 of what is measured, for 99 % no more than 32 times too
// large; coarser ones are mostly too small. None has a far code.
[[nodiscard]] std::vector<ErrorToDistance> estimate_distances(const IntervalVolume& volume, BrickIndex brick, std::span<const float> moves,
                                                              std::span<const std::uint64_t> slots);

}  // namespace intervale
