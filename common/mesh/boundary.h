// The boundary of a tetrahedral mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/mesh.h"

namespace intervale {

// The triangles that lie in one tetrahedron only, seen from outside counterclockwise, as indices into mesh.points.
// O(tetrahedra); order: by first appearance.
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const Mesh& mesh);

// The boundary of a mesh by itself: point i of it is mesh.points[points[i]]; triangles index points.
struct BoundaryMesh {
  std::vector<std::uint32_t> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
[[nodiscard]] BoundaryMesh boundary_mesh(const Mesh& mesh);

}  // namespace intervale
