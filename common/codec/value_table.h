// Codes tables of values (value_format.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/patch/value_format.h"
#include "common/util/result.h"

namespace intervale {

// One plane (byte_planes.h) of 8 bytes a value: words as planes. Word i is the difference of the order numbers of values
// i and i - 1; the first is the order number of value 0. The order number of a value is its bit pattern with the sign bit
// set if that is not set, and with all bits inverted if it is, so that order numbers ascend with the values.
// table: finite, ascending.
[[nodiscard]] std::vector<std::uint8_t> encode_value_table(std::span<const double> table);

// The inverse, for bytes from outside, of so many values exactly; fails in one line. Allocates 24 bytes a value
// at most. The values themselves are not checked (check_value_format()).
[[nodiscard]] Result<std::vector<double>> decode_value_table(std::span<const std::uint8_t> bytes, std::size_t count);

}  // namespace intervale
