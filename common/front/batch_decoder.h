// Applies batches of updates to a front; common/codec/batch.h describes the layout.
#pragma once

#include <cstdint>
#include <span>

#include "common/front/front.h"
#include "common/patch/description.h"
#include "common/util/result.h"

namespace intervale {

// Applies a batch from outside to fronts of one data set, which have the same splits, one front at least; returns how
// many updates it had. description: of the data set; shown: what the view was that the batch answers, whatever ranges
// the fronts have. The meshes get at most max_tets tetrahedra together (Front::split). Fails if the bytes are not a
// batch; the fronts must then not be used any more.
[[nodiscard]] Result<std::uint64_t> apply_batch(std::span<Front> fronts, const Description& description, const ShownRanges& shown,
                                                std::span<const std::uint8_t> bytes, std::uint64_t max_tets = ~std::uint64_t(0));

}  // namespace intervale
