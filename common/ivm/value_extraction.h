// The mesh of any range of a field, without a server.
#pragma once

#include "common/ivm/extraction.h"
#include "common/ivm/value_selection.h"

namespace intervale {

// The mesh of a range at a level of detail, within its budgets: greatest errors first. Fails if check_lod fails, and with
// misuse if the level of detail has a camera.
[[nodiscard]] Result<Extraction> extract(const ValueVolume& volume, const RangeLod& wanted, const ParallelFor& parallel = serial);

}  // namespace intervale
