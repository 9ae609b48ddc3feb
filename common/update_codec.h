// Updates on the wire: a batch as bytes, and back into a front.
//
// A batch names supercubes, and says of each diamond in them that can be split whether it is; for both sides know which those are. If it is, the
// differences of its side and its cuts follow. All that is range coded, by chances that go by what both sides know. Updates stand in the order
// in which they are applied: scale by scale from coarse to fine; within one scale all of class 0, then class 1, then class 2; then by supercube and
// slot. PROTOCOL.md has the layout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front.h"
#include "common/interval_volume.h"
#include "common/result.h"
#include "common/split_set.h"

namespace intervale {

inline constexpr std::size_t kBatchUpdatesMost = 1 << 17;  // in one batch; what a reader makes room for

// The batch of these groups: keys strictly ascending, slots not 0; at most kBatchUpdatesMost updates. split: what the client has split once the batch
// is applied, closed under parents; the groups' updates are in it.
[[nodiscard]] std::vector<std::uint8_t> encode_batch(const IntervalVolume& volume, const SplitSet& split, std::span<const SlotGroup> groups);

// Applies a batch from outside, and returns how many updates it had. Those that the mesh has no room for below max_tets, and all after them, are
// hidden (Front::hide). Fails where the bytes are no batch or an update does not fit the front, which is then of no more use.
[[nodiscard]] Result<std::uint64_t> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets = ~std::uint64_t(0));

}  // namespace intervale
