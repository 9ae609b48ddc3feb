// The domain's corners in a front. They are no diamonds, but seven of them have the offsets of diamonds of scale N
// whose centres lie there, and the root's edges are those diamonds' subdivision edges. So the root's patch is one more
// supercube, and the corner (0, 0, 0) a supercube of its own. Inside the front.
#pragma once

#include <array>
#include <cstdint>

#include "common/front/front_state.h"

namespace intervale {

// Sets the keys of the corners, in the order of the root's vertices, and adds their supercube.
void set_corner_keys(FrontState& state, const std::array<ValueKey, kRootVertices>& keys);

// Gives the corners the sides and the cuts that follow from their keys, and points: the first ones, as if there were no
// others. The mesh has then only the root's patch.
void place_corners(FrontState& state);

// The tetrahedra of the root's patch.
[[nodiscard]] std::uint64_t count_root_tets(const FrontState& state);

}  // namespace intervale
