// Checks the invariants of a data set of every range.
#pragma once

#include "common/ivm/value_volume.h"
#include "common/util/result.h"

namespace intervale {

// Checks that keys lie in the format's range, and that no diamond's error level is lower than a child's. Fails with the
// first violation.
[[nodiscard]] Result<void> validate(const ValueVolume& volume);

}  // namespace intervale
