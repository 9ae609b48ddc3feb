// Checks the invariants of an interval volume.
#pragma once

#include "common/ivm/interval_volume.h"
#include "common/util/result.h"

namespace intervale {

// Checks that every parent of an update is present, updates lie in the box, errors are saturated, sides match
// coefficients, and full refinement gives the mesh that the description states. Fails with the first violation. Takes
// as long as an extraction.
[[nodiscard]] Result<void> validate(const IntervalVolume& volume);

}  // namespace intervale
