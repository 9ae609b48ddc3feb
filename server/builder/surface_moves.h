// How far the surfaces of a diamond's tetrahedra are from those of the full mesh: what its refinement can still move, in world units.
//
// The full mesh's surfaces have their corners on the edges of the finest tetrahedra: of its cells' sides and diagonals. In a coarser tetrahedron's
// interpolant such a point has another value; that difference over the interpolant's gradient is the point's distance from the coarse patch, to
// first order, and nothing between the corners is further off. Where there is no patch, in the tetrahedron or its diamond, it is as far as the
// diamond is wide, or, for a speck that lies apart, as the one above that has a patch: its corners are in every finer mesh, on both sides of the
// surface. Points go down the bisection with their barycentric coordinates, of which each step changes two (Maubach 1995, for the order of vertices).
//
// That bounds what the full mesh is off the coarse one. The other way round there are tips of thin pieces: they slide along an edge, near to the
// plane all the while. An edge is the spine of the diamond that splits it, so that one tells how far apart the two meshes cut it.
#pragma once

#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "server/volume/volume.h"

namespace intervale {

struct SurfaceMoves {
  // Of each diamond, by number: the largest move of any surface point in it, not saturated. Diamonds of coarse scales, and those with tetrahedra that
  // the border moves, have their width for it; more than the width is where a speck is left alone.
  std::vector<float> most;
  std::vector<float> mean;  // of each supercube, by number: what points in its tetrahedra move in the mean; 0 if it was not measured
};

// Of the diamonds of `set`, the relevant ones. On all cores that oneTBB may use. Samples finite.
[[nodiscard]] SurfaceMoves surface_moves(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set);

}  // namespace intervale
