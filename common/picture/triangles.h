// The triangles of a picture: the boundary of a mesh and a cut through it, with normals.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "common/mesh/mesh.h"
#include "common/picture/value_span.h"
#include "common/picture/viewpoint.h"

namespace intervale {

// What a triangle belongs to: the alpha surface, the beta surface, a side of the box, or the cut.
enum class Part : std::uint8_t { alpha = 0, beta = 1, box = 2, cut = 3 };

// A corner of a triangle, in the layout of the vertex shader.
struct Corner {
  std::array<float, 3> position;  // in the scene
  std::array<float, 3> normal;    // outward, of length 1
  std::uint32_t look;             // equal for all three: the Part, and bit 4 << i if the side opposite corner i is drawn as an edge of the mesh
  float value;                    // where the value lies in the options' span (ValueSpan::at); 0 without a span
};

struct TriangleOptions {
  std::optional<Plane> clip;            // cuts away what lies on its normal's side (plane_cut.h)
  bool edges = false;                   // whether the edges of the boundary are drawn; those of a cut always are
  std::optional<ValueSpan> span;        // of the values, which are then there
  std::span<const double> values = {};  // one for each point of the mesh
};

// Calls take() with corners, three a triangle, counterclockwise seen from outside; some ten thousand at a time, valid
// during the call. Normals of the alpha and of the beta surface are smooth (normals.h). Triangles without an area are
// left out. The triangles and the order of their corners depend on the positions of points, not on their numbers.
// O(points + tetrahedra).
void for_each_triangle(const Mesh& mesh, const TriangleOptions& options, const Viewpoint& viewpoint,
                       const std::function<void(std::span<const Corner>)>& take);

}  // namespace intervale
