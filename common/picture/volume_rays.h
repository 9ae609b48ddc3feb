// Rays through a tetrahedral mesh: what a field between its points absorbs and emits on its way to the eye.
//
// A ray through each pixel's middle is cut by the faces of the tetrahedra: the planes of a face are computed alike for
// both tetrahedra that share it, so that one piece of the ray ends where the next begins, and rays in a face belong to
// one of the two. Pieces are sorted by where they begin (a buffer of all pieces of a ray: L. Carpenter, The A-buffer, an
// Antialiased Hidden Surface Method, SIGGRAPH 1984), and followed from the eye on. Where meshes overlap, as those of
// several ranges may, each part of the ray counts once.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "common/mesh/mesh.h"
#include "common/mesh/plane_cut.h"
#include "common/picture/value_span.h"
#include "common/util/parallel.h"
#include "common/view/lod.h"
#include "common/view/transfer_function.h"

namespace intervale {

struct VolumeRays {
  Camera camera;              // valid by check_lod; a ray for each pixel of its viewport
  Box box;                    // of the world, around the mesh
  std::optional<Plane> clip;  // cuts away what lies on its normal's side
  ValueSpan values;           // of which the transfer function's places are; values beyond have those of its ends
};

// A part of the picture: columns [left, right), rows [top, bottom), the first at the top.
struct RayTile {
  int left = 0, top = 0, right = 0, bottom = 0;
};

// Calls take() for tiles that cover the picture once, with the light of their rays, row by row from the top; the span is
// valid during the call. Tiles have even corners, but at the picture's right and lower side. Calls come from the threads
// of `parallel`, at the same time. The mesh has values. The transfer function's unit of length is a hundredth of the
// box's diagonal. The light does not depend on the order of the mesh's points and tetrahedra. Takes some 8 bytes a
// tetrahedron, 4 bytes for each tile that one lies in, and 24 bytes for each piece of the rays of a tile.
void trace_rays(const Mesh& mesh, const VolumeRays& rays, const TransferFunction& transfer, const ParallelFor& parallel,
                const std::function<void(const RayTile& tile, std::span<const RayLight> light)>& take);

}  // namespace intervale
