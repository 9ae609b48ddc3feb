// Which updates a level of detail needs, and in which order. Pure functions of the updates' errors and places.
//
// Weiss and De Floriani 2008, section 7. Errors are saturated, so the updates with an error above a threshold are closed under parents as they are,
// and descending error (then coarse before fine) is an order that never puts a child before its parent. A criterion that looks at anything else is
// closed by one pass from fine to coarse.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "common/grid.h"
#include "common/interval_volume.h"
#include "common/lod.h"
#include "common/result.h"
#include "common/split_set.h"

namespace intervale {

// Whether an update is wanted for its own sake.
using Criterion = std::function<bool(const Diamond&, double error)>;

// Checks a level of detail that comes from outside: numbers finite, in their ranges, roi not inverted.
[[nodiscard]] Result<void> check_lod(const Lod& lod);

// The error that a level of detail asks for, in the field's units.
[[nodiscard]] double error_of(const Lod& lod, const Description& description);

// The criterion of a level of detail (budgets aside). The domain and grid are copied.
[[nodiscard]] Criterion criterion_of(const Lod& lod, const Description& description);

// The updates of `set` that a criterion wants, and all their ancestors. error: of each update, by number.
[[nodiscard]] SplitSet select(const SupercubeSet& set, const std::function<double(UpdateIndex)>& error, const Criterion& wants);

// The updates that a level of detail needs, closed under parents; budgets are the caller's.
[[nodiscard]] SplitSet select(const IntervalVolume& volume, const Lod& lod);

// Greatest error first, then coarse before fine, then by number: parents always before children.
[[nodiscard]] std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const SplitSet& updates);

}  // namespace intervale
