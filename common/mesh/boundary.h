// The boundary of a tetrahedral mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/util/export.h"

namespace intervale {

// The faces that belong to one tetrahedron only, counterclockwise seen from outside, as indices into mesh.points.
// O(tetrahedra); order: by first appearance.
[[nodiscard]] INTERVALE_EXPORT std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const Mesh& mesh);

// The boundary with its own numbering: its point i is mesh.points[points[i]]; triangles index points.
struct BoundaryMesh {
  std::vector<std::uint32_t> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};
[[nodiscard]] INTERVALE_EXPORT BoundaryMesh boundary_mesh(const Mesh& mesh);

}  // namespace intervale
