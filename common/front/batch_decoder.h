// Applies batches of updates to a front; common/codec/batch.h describes the layout.
#pragma once

#include <cstdint>
#include <span>

#include "common/front/front.h"
#include "common/util/result.h"

namespace intervale {

// Applies a batch from outside, and returns how many updates it had. Those that would give the mesh more than max_tets
// tetrahedra, and all after them, are hidden (Front::hide). Fails if the bytes are not a batch, or an update does not
// fit the front; the front must then not be used any more.
[[nodiscard]] Result<std::uint64_t> apply_batch(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets = ~std::uint64_t(0));

}  // namespace intervale
