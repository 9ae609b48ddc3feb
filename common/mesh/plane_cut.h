// Cutting a tetrahedral mesh open with a plane.
//
// The rule for points in the plane: what lies strictly behind the plane (distance < 0) is kept; what lies in it, or on
// its normal's side, is cut away. So a plane through a face of the mesh gives no cut with nothing behind it, and the
// cuts and the kept parts of the boundary triangles close around what is kept without a gap: where they share an edge
// of the mesh, both have the same point on it, to the last bit.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/util/result.h"
#include "common/util/vec3.h"

namespace intervale {

// World coordinates. The normal has any length but 0.
struct Plane {
  Vec3 point{};
  Vec3 normal{};
  friend bool operator==(const Plane&, const Plane&) = default;
};

// Misuse unless all numbers are finite and the normal is not 0.
[[nodiscard]] Result<void> check_plane(const Plane& plane);

// The signed distance of each point of the mesh from the plane, in world units: negative for what is kept.
[[nodiscard]] std::vector<double> plane_distances(const Mesh& mesh, const Plane& plane);

// Where the edge between a kept end (distance < 0) and one cut away (distance >= 0) crosses the plane.
[[nodiscard]] Vec3 crossing(const Vec3& kept, double kept_distance, const Vec3& away, double away_distance);

// A place on the edge between a kept corner and one cut away, as a fraction of the edge from the kept one.
struct CutEdge {
  std::uint32_t kept = 0, away = 0;
  double fraction = 0;
};

// A convex polygon: the first `count` corners, 0 (no cut), 3 or 4, counterclockwise seen from the normal's side. Each
// side lies in a face of the tetrahedron.
struct TetCut {
  std::uint8_t count = 0;
  std::array<Vec3, 4> corners{};
  std::array<CutEdge, 4> on{};  // the edge that each corner lies on: numbers of the tetrahedron's corners; of plane_cut(), of the mesh's points
};

// The cut through a positive tetrahedron, from its corners' distances, in any unit. A tetrahedron that the plane only
// touches, in a corner or along an edge, has none; one that lies behind the plane, with a face in it, has that face.
[[nodiscard]] TetCut cut_tet(const std::array<Vec3, 4>& corners, const std::array<double, 4>& distances);

// The cuts through the tetrahedra of a mesh that have one, in the order of mesh.tets. O(points + tetrahedra).
[[nodiscard]] std::vector<TetCut> plane_cut(const Mesh& mesh, const Plane& plane);

}  // namespace intervale
