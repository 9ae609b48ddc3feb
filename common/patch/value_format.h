// How the values of a field are represented by whole numbers, its keys: exactly, or in steps.
#pragma once

#include <cstdint>
#include <cstring>

#include "common/patch/sample_type.h"
#include "common/util/result.h"

namespace intervale {

// A whole number that stands for a value; greater keys stand for greater values. 0: the least value of the field.
using ValueKey = std::uint32_t;

// Key k stands for (first + k) * step, rounded to the type of the samples. If step is 0, it stands for the k-th number
// of that type (f32) from number `first` on, where numbers are counted in ascending order and 0 has the number 0 (so
// that -0 is 0).
struct ValueFormat {
  SampleType type = SampleType::u8;
  double step = 1;         // 0 or more, finite; 1 for whole numbers
  std::int64_t first = 0;  // the least value, as a number of steps
  ValueKey last = 0;       // the greatest key, at most 2^32 - 2

  [[nodiscard]] double value(ValueKey key) const {
    const std::int64_t n = first + std::int64_t(key);
    if (step == 0) {
      const auto bits = std::uint32_t(n < 0 ? -n : n);
      float size = 0;
      std::memcpy(&size, &bits, sizeof size);  // no std::bit_cast, which Emscripten lacks
      return double(n < 0 ? -size : size);
    }
    const double product = double(n) * step;
    return type == SampleType::f32 ? double(float(product)) : product;
  }
  // The key of the value that is nearest; between keys half up. value: finite; below the least value 0, above the
  // greatest one `last`.
  [[nodiscard]] ValueKey key(double value) const;
  [[nodiscard]] double least() const { return value(0); }
  [[nodiscard]] double greatest() const { return value(last); }
  friend bool operator==(const ValueFormat&, const ValueFormat&) = default;
};

// Checks a format from outside: a step that is finite and not negative, no f64 with step 0, and finite values that
// differ from key to key at both ends.
[[nodiscard]] Result<void> check_value_format(const ValueFormat& format);

}  // namespace intervale
