// Applies batches of updates to a front; common/codec/batch.h describes the layout.
#pragma once

#include <cstdint>
#include <span>

#include "common/front/front.h"
#include "common/util/result.h"

namespace intervale {

// Applies a batch from outside, and returns how many updates it had. Those that the mesh has no room for below max_tets, and all after them, are
// hidden (Front::hide). Fails where the bytes are no batch or an update does not fit the front, which is then of no more use.
[[nodiscard]] Result<std::uint64_t> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets = ~std::uint64_t(0));

}  // namespace intervale
