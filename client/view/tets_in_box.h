// The tetrahedra of a part of a mesh, to be drawn one by one (paper, figure 7).
#pragma once

#include <cstdint>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/view/lod.h"

namespace intervale {

// A corner of a tetrahedron, and the middle of that: positions in samples.
struct TetVertex {
  float x = 0, y = 0, z = 0;
  float middle_x = 0, middle_y = 0, middle_z = 0;
  Surface surface = Surface::inside;
  std::uint8_t lod = 0;    // as of SurfaceVertex
  std::uint8_t range = 0;  // for a caller that draws several meshes: which one
  std::uint8_t padding = 0;
};
static_assert(sizeof(TetVertex) == 28);

struct TetsInBox {
  std::vector<TetVertex> vertices;  // four a tetrahedron, positive in the world
  std::vector<PointId> points;      // of the mesh, one for each vertex
  std::uint64_t count = 0;
  std::uint64_t out_of = 0;  // that lie there
};

// Those whose middles lie in the box (world coordinates), `most` of them at most. By the surface's last update.
[[nodiscard]] TetsInBox tets_in_box(const BoundarySurface& surface, const Box& box, std::uint64_t most);

}  // namespace intervale
