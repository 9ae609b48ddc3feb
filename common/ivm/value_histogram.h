// How often values of a field occur.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace intervale {

// Bin i counts the samples v with least + i * width <= v < least + (i + 1) * width; the last bin also those at its
// upper end.
struct ValueHistogram {
  double least = 0;                  // the least value of the field
  double width = 0;                  // of each bin; greater than 0
  std::vector<std::uint64_t> count;  // by bin; 1 to kMostBins bins, the first and the last are not empty
  friend bool operator==(const ValueHistogram&, const ValueHistogram&) = default;
};
inline constexpr std::size_t kMostBins = 256;

}  // namespace intervale
