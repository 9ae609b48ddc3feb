#include "client/core/draw_depth_map.h"

#include "common/mesh/boundary.h"

namespace intervale {

std::optional<DepthMap> draw_depth_map(const StreamClient& client, const Camera& camera) {
  if (client.updates() > kMostUpdatesOfMap) return {};
  const Mesh mesh = client.mesh();
  DepthBuffer buffer(camera);
  for (const auto& [a, b, c] : boundary_triangles(mesh)) buffer.draw({mesh.points[a], mesh.points[b], mesh.points[c]});
  return buffer.map();
}

}  // namespace intervale
