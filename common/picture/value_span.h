// Which values have the colours at the two ends of a palette.
#pragma once

#include "common/patch/description.h"

namespace intervale {

// low <= high, finite.
struct ValueSpan {
  double low = 0, high = 0;
  // Where a finite value lies: 0 at low, 1 at high, also beyond, but not as far as a float cannot tell. 0.5 if low is high.
  [[nodiscard]] double at(double value) const;
  [[nodiscard]] double middle() const { return low / 2 + high / 2; }
  friend bool operator==(const ValueSpan&, const ValueSpan&) = default;
};

// The part of a range that a data set has values in: from its least to its greatest value at most. Where that is not
// more than one value, as of a surface, all values of the data set.
[[nodiscard]] ValueSpan span_of(const Description& description, const Range& range);

}  // namespace intervale
