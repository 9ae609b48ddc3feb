// The domain's corners in a front. They are no diamonds, but seven of them have the offsets of diamonds of scale N
// whose centres lie there, and the root's edges are those diamonds' subdivision edges. So the root patch is one more
// supercube, and the corner (0, 0, 0) a supercube of its own. Inside the front.
#pragma once

#include <array>

#include "common/front/front_state.h"
#include "common/patch/root_patch.h"

namespace intervale {

// Appends the points of the corners to a front without points, and counts the tetrahedra of the root's patch.
void place_corners(FrontState& state, const RootPatch& root_patch);
[[nodiscard]] std::uint64_t count_root_tets(const FrontState& state, const RootPatch& root_patch);

// Of a front split by values: the keys of the corners, in the order of the root's vertices; and the patch that they
// have for the range.
void set_corner_keys(FrontState& state, const std::array<ValueKey, kRootVertices>& keys);
[[nodiscard]] RootPatch root_patch_of(const FrontState& state);

}  // namespace intervale
