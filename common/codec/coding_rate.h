// The best rate of the range coder (range_coder.h): what a number of bytes can hold at most.
#pragma once

#include <cstdint>

namespace intervale {

// No BitModel holds a bit for less probable than this, in 1/65536: below, learn() rounds the change to 0.
inline constexpr std::uint32_t kLeastProbability = 63;

// The most bits of models that so many bytes decode to. The likeliest bit takes -log2(1 - kLeastProbability / 65536) =
// 1/720.7 of a bit, so a byte holds 5,766 of them at most. Whoever reads a number of things that take a bit or more each
// compares it with this before anything is allocated for them.
[[nodiscard]] constexpr std::uint64_t most_coded_bits(std::uint64_t bytes) { return 5'770 * bytes; }

}  // namespace intervale
