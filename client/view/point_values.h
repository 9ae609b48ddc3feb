// The values of the field, or of a channel, at the points of a mesh, for colours by value.
#pragma once

#include <span>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/front/channel_values.h"

namespace intervale {

// By PointId: of the points of the mesh as the surface has it; other ids have any number. In the field's units, rounded
// to floats; what is beyond them is the greatest float. For use before the front changes again. O(points).
[[nodiscard]] std::vector<float> point_values(const BoundarySurface& surface);

// The same of a channel: of a scalar its values, of a vector the lengths. Where the client has no value, the least of the
// first component. Several times as slow.
[[nodiscard]] std::vector<float> point_values(const BoundarySurface& surface, const ChannelValues& channel);

// Those of some points, in their order. values: by PointId.
[[nodiscard]] std::vector<float> values_of(std::span<const PointId> points, std::span<const float> values);

}  // namespace intervale
