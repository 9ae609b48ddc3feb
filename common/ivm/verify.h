// Checks an interval volume against the laws that every one obeys.
#pragma once

#include "common/ivm/interval_volume.h"
#include "common/util/result.h"

namespace intervale {

// Checks every invariant: every parent of an update is present, updates lie in the box, errors are saturated, sides fit coefficients, and refined to
// the end it gives the mesh that the description promises. Fails with the first that does not hold. Takes as long as an extraction.
[[nodiscard]] Result<void> validate(const IntervalVolume& volume);

}  // namespace intervale
