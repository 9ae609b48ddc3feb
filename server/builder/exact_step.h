// Finds the step of which all values of a field are whole multiples, from the values alone.
#pragma once

#include <optional>
#include <span>

#include "common/patch/value_format.h"

namespace intervale {

// A format that gives every value back bit for bit (-0 as 0), with `last` at most `most`; none if no such step is
// found.
// Finds the greatest common divisor of the values, and a step S that made them as round(k * S), as long as rounding
// moved them by much less than S; if neighbouring values are many steps apart, and the smallest one is more than 2^20
// steps, only if rounding moved them by no more than some hundredths of S. Takes a simple number where several serve:
// whole, 1 / whole, or one of few digits. A single value always has a format.
// values: finite, ascending, each once, at least one; type: of floats.
// O(n log n) for n values; for values that have no step usually less.
[[nodiscard]] std::optional<ValueFormat> find_exact_format(SampleType type, std::span<const double> values, ValueKey most);

}  // namespace intervale
