// Which diamonds of an interval volume are relevant to a range.
#pragma once

#include <cstdint>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"

namespace intervale {

// The slots of a volume's diamonds that are relevant, by supercube: those that count for the range (front.h), and their
// ancestors. The volume was refined uniformly.
[[nodiscard]] std::vector<std::uint64_t> relevant_slots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel = serial);

}  // namespace intervale
