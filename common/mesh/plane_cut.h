// Cutting a mesh open: where a plane goes through its tetrahedra and its triangles.
//
// What is kept lies strictly behind the plane; what lies on it or on its normal's side is cut away. So a plane through a face of the mesh never gives
// a cut with nothing behind it, and the cuts and the kept parts of the boundary triangles close around what is kept without a gap: where an edge is
// cut, both have the same point, to the last bit.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/util/result.h"

namespace intervale {

// World coordinates. The normal has any length but 0.
struct Plane {
  std::array<double, 3> point{};
  std::array<double, 3> normal{};
  friend bool operator==(const Plane&, const Plane&) = default;
};

// Misuse unless all numbers are finite and the normal is not 0.
[[nodiscard]] Result<void> check_plane(const Plane& plane);

// How far each point of the mesh is beyond the plane, in its normal's lengths: negative for what is kept.
[[nodiscard]] std::vector<double> distances_beyond(const Mesh& mesh, const Plane& plane);

// Where an edge between a kept end and one cut away goes through the plane.
[[nodiscard]] std::array<double, 3> crossing(const std::array<double, 3>& kept, double kept_distance, const std::array<double, 3>& away,
                                             double away_distance);

// A triangle or a quadrilateral: the first `count` corners, 3 or 4, counterclockwise seen from the normal's side, convex. Its sides are where the
// plane goes through the tetrahedron's faces.
struct TetCut {
  std::uint32_t tet = 0;  // index into mesh.tets
  std::uint8_t count = 0;
  std::array<std::array<double, 3>, 4> corners{};
};

// The plane's cut through each tetrahedron that it goes through, in the order of mesh.tets. A tetrahedron that it only touches, in a corner or along
// an edge, has none; one that lies behind it, with a face in it, has that face. O(points + tetrahedra).
[[nodiscard]] std::vector<TetCut> plane_cut(const Mesh& mesh, const Plane& plane);

}  // namespace intervale
