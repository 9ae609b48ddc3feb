// Which updates a level of detail needs, and in which order. Pure functions of the updates' errors and positions.
//
// Weiss and De Floriani 2008, section 7. What is wanted for its own sake counts for a range (front.h) and is coarse enough;
// one pass from fine to coarse adds all ancestors.
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

// The updates of `set` for which `wants` returns true, and all their ancestors.
[[nodiscard]] SplitSet select(const SupercubeSet& set, const std::function<bool(const Place&)>& wants);

// The relevant updates that a level of detail needs, and all their ancestors. Budgets are not applied.
[[nodiscard]] SplitSet select(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod);
// The same, for the range of the data set.
[[nodiscard]] inline SplitSet select(const IntervalVolume& volume, const Lod& lod) { return select(volume, volume.relevant(), lod); }

// `updates`, closed under parents, in descending order of rank (ranking.h), where an ancestor has at least the rank of
// its descendants; equal ranks from coarse to fine, then by number. So parents always come before children.
[[nodiscard]] std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const RelevantUpdates& relevant, const SplitSet& updates,
                                                const Lod& lod);
// The same, for the range of the data set.
[[nodiscard]] inline std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const SplitSet& updates, const Lod& lod) {
  return in_order(volume, volume.relevant(), updates, lod);
}

}  // namespace intervale
