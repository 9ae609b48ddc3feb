// Encodes batches of updates; common/codec/batch.h describes the layout.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/batch.h"
#include "common/diamond/split_set.h"
#include "common/ivm/interval_volume.h"

namespace intervale {

// The batch of these groups: keys strictly ascending, slots not 0; at most kBatchUpdatesMost updates. shown: what the
// client looks at. split: what it has split once the batch is applied, closed under parents; the groups' updates are in
// it.
[[nodiscard]] std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, const ShownRanges& shown, const SplitSet& split,
                                                     std::span<const SlotGroup> groups);

}  // namespace intervale
