// What a picture of a mesh is drawn from: the triangles of its boundary and of a cut through it, with normals.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "common/mesh/mesh.h"
#include "common/picture/viewpoint.h"

namespace intervale {

// What a triangle is part of: the alpha surface, the beta surface, the sides of the box, the cut.
enum class Part : std::uint8_t { alpha = 0, beta = 1, box = 2, cut = 3 };

// A corner of a triangle, as the graphics library takes it.
struct Corner {
  std::array<float, 3> position;  // in the scene
  std::array<float, 3> normal;    // outward, of length 1
  std::uint32_t look;             // the same for all three: the Part, and 4 << i: the side opposite corner i is an edge of the mesh, to be drawn
};

struct TriangleOptions {
  std::optional<Plane> clip;  // what lies on its normal's side is cut away
  bool edges = false;         // whether the edges of the boundary are drawn; those of a cut always are
};

// Hands the corners over, three by three, counterclockwise seen from outside; some ten thousand at a time, valid during the call. Normals of the
// alpha and of the beta surface are smooth: of its triangles around the point, weighted by their angles there (Thuermer and Wuethrich, Computing
// Vertex Normals from Polygonal Facets, 1998). Triangles without an area are left out. Which triangles come, and
// how their corners follow each other, depends on where points lie and not on their numbers. O(points + tetrahedra).
void for_each_triangle(const Mesh& mesh, const TriangleOptions& options, const Viewpoint& viewpoint,
                       const std::function<void(std::span<const Corner>)>& take);

}  // namespace intervale
