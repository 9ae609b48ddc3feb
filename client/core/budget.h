// Which of the updates that a client has are in its mesh.
//
// As ROAM's two queues (Duchaineau et al., "ROAMing Terrain: Real-time Optimally Adapting Meshes", 1997): the most
// important hidden splits are shown, and the least important shown ones make room for them. A client does not know the
// errors of its updates, so the size of their diamonds on the screen stands for their importance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/front/front.h"
#include "common/view/lod.h"
#include "common/view/seen_box.h"

namespace intervale {

// The importance of the splits in a supercube; above 0.
using Importance = std::function<double(SupercubeKey)>;

// The size of the supercube's diamonds on the camera's screen, in pixels; less outside the picture. camera: one that
// check_lod accepts.
[[nodiscard]] Importance size_on_screen(const Camera& camera, const Grid& grid);

// Hides and shows splits of fronts of one data set, which have the same splits, until their meshes have at most max_tets
// tetrahedra together and, as far as that allows, the most important splits with their ancestors. On the way they have
// at most max_tets tetrahedra, or fewer than before. O(n log n) in a front's supercubes.
// region: if not null, splits of diamonds that do not meet it are hidden, but for ancestors of those that do.
void balance(std::span<Front> fronts, std::uint64_t max_tets, const Importance& importance, const SeenBox* region = nullptr);
inline void balance(Front& front, std::uint64_t max_tets, const Importance& importance, const SeenBox* region = nullptr) {
  balance(std::span(&front, 1), max_tets, importance, region);
}

// The least important splits of a front: `count` of them, or those of max_supercubes supercubes if these have fewer.
// All children of a split in the result are in it too, so Front::forget undoes every one. Keys ascending.
[[nodiscard]] std::vector<SlotGroup> least_important(const Front& front, std::uint64_t count, std::size_t max_supercubes,
                                                     const Importance& importance);

}  // namespace intervale
