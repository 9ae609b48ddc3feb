// Rounds numbers up to floats.
#pragma once

#include <cmath>
#include <limits>

namespace intervale {

// The least float that is no less than `value`; the greatest finite float if there is none. value: a number, at least 0.
[[nodiscard]] inline float round_up(double value) {
  constexpr float kMost = std::numeric_limits<float>::max();
  if (value >= double(kMost)) return kMost;
  const auto nearest = float(value);
  return double(nearest) < value ? std::nextafter(nearest, kMost) : nearest;
}

}  // namespace intervale
