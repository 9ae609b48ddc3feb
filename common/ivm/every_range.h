// A data set of every range as an interval volume: all diamonds, refined uniformly between -inf and inf.
#pragma once

#include "common/ivm/interval_volume.h"
#include "common/ivm/value_volume.h"
#include "common/util/parallel.h"

namespace intervale {

// The same values, with the error levels of all diamonds. Fails as IntervalVolume::assemble() does. Its own range moves
// no surface: relevant() has all updates, and no distances.
[[nodiscard]] Result<IntervalVolume> of_every_range(ValueVolume::Parts values, const ParallelFor& parallel = serial);

}  // namespace intervale
