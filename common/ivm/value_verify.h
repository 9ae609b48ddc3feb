// Checks the invariants of a data set of every range.
#pragma once

#include "common/ivm/value_volume.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// Checks that keys lie in the format's range, that no diamond's error level is lower than a child's, and that the bounds of
// pages hold what lies around them. Fails with the first violation.
[[nodiscard]] Result<void> validate(const ValueVolume& volume, const ParallelFor& parallel = serial);

}  // namespace intervale
