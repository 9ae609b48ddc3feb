// Which of the updates that a client has are in its mesh.
//
// As ROAM's two queues (Duchaineau et al. 1997): what matters most of what is hidden is shown, and what matters least of what is shown makes room for
// it. A client does not know what errors updates mend. It takes the size of their diamonds on its screen for it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/front/front.h"
#include "common/view/lod.h"

namespace intervale {

// How much the splits in a supercube matter; above 0.
using Importance = std::function<double(SupercubeKey)>;

// What a diamond of the supercube measures on the camera's screen, in pixels, less beside the picture. camera: one that check_lod lets pass.
[[nodiscard]] Importance size_on_screen(const Camera& camera, const Grid& grid);

// Hides and shows splits of a front until its mesh has max_tets tetrahedra at most, and, as far as that allows, those splits that matter most and
// their ancestors. No mesh on the way is larger than that, or than the one before it. O(n log n) in the front's supercubes.
void balance(Front& front, std::uint64_t max_tets, const Importance& importance);

// Splits of a front that matter least, as many as `count` and in no more than max_supercubes, with no child that is not among them: what
// Front::forget undoes all of. Keys ascending.
[[nodiscard]] std::vector<SlotGroup> least_important(const Front& front, std::uint64_t count, std::size_t max_supercubes,
                                                     const Importance& importance);

}  // namespace intervale
