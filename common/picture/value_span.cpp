#include "common/picture/value_span.h"

#include <algorithm>

namespace intervale {

double ValueSpan::at(double value) const {
  constexpr double kFarthest = 1e6;
  if (!(low < high)) return 0.5;
  // Halved: differences of doubles can overflow.
  return std::clamp((value / 2 - low / 2) / (high / 2 - low / 2), -kFarthest, kFarthest);
}

ValueSpan span_of(const Description& description, const Range& range) {
  const double least = description.format.least(), greatest = description.format.greatest();
  const ValueSpan span{std::max(range.alpha, least), std::min(range.beta, greatest)};
  return span.low < span.high ? span : ValueSpan{least, greatest};
}

}  // namespace intervale
