// Which updates a level of detail needs, and in which order. Pure functions of the updates' errors and places.
//
// Weiss and De Floriani 2008, section 7. Errors are saturated, so the updates with an error above a threshold are closed under parents as they are.
// What looks at places too is closed by one pass from fine to coarse.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/diamond/grid.h"
#include "common/diamond/split_set.h"
#include "common/ivm/interval_volume.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

// The updates of `set` that `wants` names, and all their ancestors.
[[nodiscard]] SplitSet select(const SupercubeSet& set, const std::function<bool(const Place&)>& wants);

// The updates that a level of detail needs, closed under parents; budgets are the caller's.
[[nodiscard]] SplitSet select(const IntervalVolume& volume, const Lod& lod);

// `updates`, closed under parents, as a level of detail ranks them: what matters most first, an ancestor as much as what needs it, then coarse before
// fine, then by number. So parents always come before children.
[[nodiscard]] std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const SplitSet& updates, const Lod& lod);

}  // namespace intervale
