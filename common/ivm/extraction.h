// Refining a mesh to a level of detail, without a server: from Sigma, or from any other source of the same updates.
#pragma once

#include <cstdint>
#include <functional>

#include "common/front/front.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/refinement.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct Extraction {
  Front front;
  std::uint64_t updates = 0;
};

// The mesh of a level of detail, budgets included: best first, and never more than max_tets tetrahedra or max_updates updates. Fails on a lod that
// check_lod refuses, and on a volume whose updates do not fit together (validate() says which).
[[nodiscard]] Result<Extraction> extract(const IntervalVolume& volume, const Lod& lod, const OnProgress& progress = {},
                                         const ParallelFor& parallel = serial);

// The mesh after the given updates, which must be closed under parents. apply: splits the diamond of a place, and says whether that could be done.
[[nodiscard]] Result<Extraction> extract(const Grid& grid, const RootPatch& root_patch, const SupercubeSet& set, const SplitSet& split,
                                         const std::function<bool(Front&, Front::Handle, const Place&)>& apply, const OnProgress& progress = {});

}  // namespace intervale
