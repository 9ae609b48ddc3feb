// The values of the field and of channels at a point, for a probe.
#pragma once

#include <optional>
#include <vector>

#include "client/core/stream_client.h"
#include "common/util/vec3.h"

namespace intervale {

struct ValuesAt {
  double field = 0;              // in its units
  std::vector<double> channels;  // by number in the data set; of a vector the length; NaN where the client has no values
};

// In the tetrahedron that has the point, interpolated between its vertices: of what the client's meshes are made of, the
// finest one if they are several. point: world coordinates. None outside of the box. O(levels).
[[nodiscard]] std::optional<ValuesAt> values_at(const StreamClient& client, const Vec3& point);

}  // namespace intervale
