// An indexed tetrahedral mesh of an interval volume.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace intervale {

// What a mesh point lies on: a grid vertex inside the range, the alpha surface or the beta surface.
enum class Surface : std::uint8_t { inside = 0, alpha = 1, beta = 2 };

// Points in world coordinates, each used by a tetrahedron and given once; tetrahedra as four point indices, positively oriented:
// (p1 - p0) x (p2 - p0) . (p3 - p0) > 0 (zero only where alpha = beta).
struct Mesh {
  std::vector<std::array<double, 3>> points;
  std::vector<Surface> surface;  // one for each point
  std::vector<std::array<std::uint32_t, 4>> tets;
};

}  // namespace intervale
