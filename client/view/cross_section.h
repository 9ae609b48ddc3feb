// What a plane cuts out of a mesh: the cut through each tetrahedron, so that a mesh cut open shows what it is made of.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/util/vec3.h"

namespace intervale {

// What lies strictly behind the plane, dot(normal, p) < offset, is kept; what lies in it, or on the normal's side, is
// cut away (plane_cut.h). World coordinates; normal: of length 1.
struct CutPlane {
  Vec3 normal{};
  double offset = 0;
};

// side[k]: the distance from the triangle's side opposite to corner k, 255 there and 0 on that side; 255 at all three
// corners where that side is not one of the cut tetrahedron's. So a shader can draw the cut tetrahedra's outlines.
struct SectionVertex {
  float x = 0, y = 0, z = 0;  // samples
  std::array<std::uint8_t, 3> side{};
  std::uint8_t lod = 0;  // as of SurfaceVertex
};
static_assert(sizeof(SectionVertex) == 16);

struct CrossSection {
  std::vector<SectionVertex> vertices;  // three a triangle; triangles face the normal's side
  std::vector<float> values;            // of the field, one for each vertex
};

// By the surface's last update. point_values: by PointId (point_values.h); without them, the section has no values.
[[nodiscard]] CrossSection cross_section(const BoundarySurface& surface, const CutPlane& plane, std::span<const float> point_values = {});

}  // namespace intervale
