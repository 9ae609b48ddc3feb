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

// The mesh of a level of detail within its budgets: most important updates first, never more than max_tets tetrahedra
// or max_updates updates. Fails if check_lod fails, and on a volume whose updates contradict each other (validate()
// says which).
[[nodiscard]] Result<Extraction> extract(const IntervalVolume& volume, const Lod& lod, const OnProgress& progress = {},
                                         const ParallelFor& parallel = serial);

// The mesh after the given updates, which must be closed under parents. apply: splits the diamond of a place; false if
// that is impossible.
[[nodiscard]] Result<Extraction> extract(const Grid& grid, const RootPatch& root_patch, const SupercubeSet& set, const SplitSet& split,
                                         const std::function<bool(Front&, Front::Handle, const Place&)>& apply, const OnProgress& progress = {});

}  // namespace intervale
