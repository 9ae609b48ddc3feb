// How the values of a field are represented by whole numbers, its keys: in steps, or exactly.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

#include "common/patch/sample_type.h"
#include "common/util/result.h"

namespace intervale {

// A whole number that stands for a value; greater keys stand for greater values. 0: the least value of the field.
using ValueKey = std::uint32_t;

// Key k stands for (first + k) * step, rounded to the type of the samples. If step is 0, values are exact whatever they
// are. f32: key k stands for the k-th number of that type from number `first` on, where numbers are counted in ascending
// order and 0 has the number 0 (so that -0 is 0). Other types: for the k-th value of a table.
struct ValueFormat {
  SampleType type = SampleType::u8;
  double step = 1;         // 0 or more, finite; 1 for whole numbers
  std::int64_t first = 0;  // the least value, as a number of steps
  ValueKey last = 0;       // the greatest key, at most 2^32 - 2
  // The values by key, last + 1 of them, if step is 0 and the type is not f32; otherwise null. Immutable, shared by all
  // copies of the format.
  std::shared_ptr<const std::vector<double>> table = {};

  // key: at most `last`.
  [[nodiscard]] double value(ValueKey key) const {
    const std::int64_t n = first + std::int64_t(key);
    if (step == 0) {
      if (table) return (*table)[key];
      const auto bits = std::uint32_t(n < 0 ? -n : n);
      float size = 0;
      std::memcpy(&size, &bits, sizeof size);  // no std::bit_cast, which Emscripten lacks
      return double(n < 0 ? -size : size);
    }
    const double product = double(n) * step;
    return type == SampleType::f32 ? double(float(product)) : product;
  }
  // The key of the value that is nearest; between keys half up. O(log last) with a table. value: finite; below the
  // least value 0, above the greatest one `last`.
  [[nodiscard]] ValueKey key(double value) const;
  [[nodiscard]] double least() const { return value(0); }
  [[nodiscard]] double greatest() const { return value(last); }
  [[nodiscard]] std::size_t memory_bytes() const { return table ? table->size() * sizeof(double) : 0; }  // of the table
  friend bool operator==(const ValueFormat& a, const ValueFormat& b);                                    // compares the contents of tables
};

// Whether a format of this step and type has a table.
[[nodiscard]] inline bool has_table(double step, SampleType type) { return step == 0 && type != SampleType::f32; }

// The format of the values of a table. values: finite, ascending, no -0; 1 to 2^32 - 1 of them; type: not f32.
[[nodiscard]] ValueFormat format_of_table(SampleType type, std::vector<double> values);

// Checks a format from outside: a step that is finite and not negative, and finite values that differ from key to key
// at both ends. A table is there if the format needs one, has last + 1 values, ascends everywhere and has no -0.
[[nodiscard]] Result<void> check_value_format(const ValueFormat& format);

}  // namespace intervale
