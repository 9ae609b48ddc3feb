// How far surfaces move, and what updates take away, estimated: for a range that was just chosen, until
// error_to_distance.h has measured it.
//
// By a change of the value over the steepness of the values around: an update moves the surface that goes through its
// diamond by the part of the diamond's width that its error is of the difference of the values at the diamond's vertices.
// Where only the centre is on the other side of the surface than the ends of the spine, it moves by half of the width.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/ivm/brick_needs.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/value_bounds.h"

namespace intervale {

struct EstimatedSurface {
  std::vector<ErrorToDistance> to_distance;  // by supercube; none is far
  BrickPart::Surface of_updates;             // of relevant updates
};

// Of a brick of a volume that was refined uniformly. counts: for a range with one surface. relevant: by supercube
// (RelevantSlots). Of ten distances of scale 0, saturated, eight are between a half and eight times what is measured, and
// one of a hundred is more than 40 times too large. Some microseconds.
[[nodiscard]] EstimatedSurface estimate_surface(const IntervalVolume& volume, const CountingKeys& counts, BrickIndex brick,
                                                std::span<const std::uint64_t> relevant);

// Upper bounds of what is estimated for an update of this scale.
struct EstimateBound {
  float distance = 0;
  std::uint8_t slope = 0;
};
[[nodiscard]] EstimateBound bound_of_estimates(const Grid& grid, int scale);

}  // namespace intervale
