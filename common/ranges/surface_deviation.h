// How far the surfaces of a diamond's tetrahedra are from those of the full mesh: how far its refinement can still move
// them, in world units.
//
// The full mesh's surfaces have their corners on the edges of the finest tetrahedra: the sides and diagonals of cells.
// In a coarser tetrahedron's interpolant such a point has another value. That difference divided by the length of the
// interpolant's gradient is, to first order, the point's distance from the coarse patch; nothing between the corners is
// further away. Where neither the tetrahedron nor its diamond has a patch, the distance is the diamond's width; or, for
// a small piece far from any other surface, the width of the finest coarser diamond that has a patch: its corners are
// in every finer mesh, on both sides of the surface. Points descend the bisection with their barycentric coordinates,
// of which each step changes two.
//
// That bounds the distance from the full mesh to the coarse one. In the other direction, tips of thin pieces slide
// along an edge and stay near the plane all the while. Such an edge is the spine of the diamond that splits it, so that
// diamond measures how far apart the two meshes cut it.
//
// Distances to first order are off where the nearest point of a patch's plane is not in the patch. Where that matters,
// crossing_measure.h takes the distance to the patch, and patch_measure.h finds patches that cover holes.
#pragma once

#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "common/patch/volume.h"
#include "common/util/parallel.h"

namespace intervale {

struct SurfaceDeviation {
  // By update: the largest deviation of any surface point in its diamond, not saturated. For diamonds of coarse scales,
  // and those with tetrahedra that the border moves: their width. More than the width where a small piece has no patch.
  std::vector<float> largest;
  // By update, if it was asked for: like `largest`, but of distances that are not to first order; and the distances of some
  // points of the patches to the surface.
  std::vector<float> farthest;
  // By supercube: the mean over the surface points in its tetrahedra; 0 if it was not measured.
  std::vector<float> mean;
  // By update: the sum over the surface points in its tetrahedra of what its refinement takes off the square of their
  // deviation, in squares of the least spacing; below 0 where it moves the surface away. Not measured for diamonds of
  // scales coarser than top_scale: 0. The same whatever the number of threads.
  std::vector<double> removed;
  int top_scale = 0;
};

// Of the diamonds of `set`, the relevant ones. Samples are finite. Of `range` only the surfaces count: alpha may be
// greater than beta. Throws what `parallel` throws.
[[nodiscard]] SurfaceDeviation surface_deviation(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set,
                                                 bool with_farthest = false, const ParallelFor& parallel = serial);

}  // namespace intervale
