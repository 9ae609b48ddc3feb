// What a range needs of an interval volume that has it.
#pragma once

#include <memory>

#include "common/ivm/interval_volume.h"

namespace intervale {

// shown: as check_held() accepts it for the volume. Distances are measured (error_to_distance.h) if has_distances, and
// 0 otherwise. Uses all cores that oneTBB may; takes some 8 bytes a sample meanwhile.
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume,
                                                                           const ShownRange& shown, bool has_distances);
// The same for several ranges, one at least.
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume,
                                                                           const ShownRanges& shown, bool has_distances);

}  // namespace intervale
