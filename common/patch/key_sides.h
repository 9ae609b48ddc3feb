// The sides of keys (value_format.h) with respect to a range, by comparing whole numbers.
#pragma once

#include <cstdint>

#include "common/patch/range.h"
#include "common/patch/value_format.h"

namespace intervale {

class KeySides {
 public:
  // range: alpha <= beta; either may be infinite.
  KeySides(const ValueFormat& format, const Range& range);

  // The first key that is not below the range, and the first one above it; last + 1 if there is none.
  [[nodiscard]] std::uint64_t first_inside() const { return first_inside_; }
  [[nodiscard]] std::uint64_t first_above() const { return first_above_; }

  // side_of(format.value(key), range). key: at most format.last.
  [[nodiscard]] Side side(ValueKey key) const { return Side(unsigned(key >= first_inside_) + unsigned(key >= first_above_)); }

 private:
  std::uint64_t first_inside_, first_above_;
};

}  // namespace intervale
