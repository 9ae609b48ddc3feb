// The ranges of the clients of a load that drag them: pure functions of a seed and the number of a view.
#pragma once

#include <cstdint>

#include "common/patch/description.h"

namespace intervale {

// Somebody drags alpha by ten moves, rests for a second, drags beta by ten moves, rests, and so on. A move is 5 % of
// the values on average and up to twice that. Each end goes on in its direction, seeded at first, and turns at the ends
// of its way: alpha's is from the least value to the middle of the start, beta's from there to the greatest value.
struct RangePath {
  Range start;             // alpha <= beta; what of it is beyond the values is cut off
  Range values;            // the least and the greatest value of the field, finite
  std::uint64_t seed = 0;  // of one client; it determines directions and moves
};

// Range number 0, 1, 2, … of the path: the start, and then the one after each move. alpha <= beta, both within the
// values. Equal arguments give equal ranges, up to rounding on other machines. O(1).
[[nodiscard]] Range range_of(const RangePath& path, std::uint64_t number);

// The rests before that range, in seconds, all together.
[[nodiscard]] double rests_before(std::uint64_t number);

// The least and the greatest value of a data set of every range.
[[nodiscard]] inline Range values_of(const Description& description) { return {description.format.least(), description.format.greatest()}; }

// The range that a path starts with unless another one is given, as in the viewer: the upper half of the values.
[[nodiscard]] inline Range upper_half(const Range& values) { return {values.alpha / 2 + values.beta / 2, values.beta}; }

}  // namespace intervale
