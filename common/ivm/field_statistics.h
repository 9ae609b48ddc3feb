// What a data set of every range tells of its field, to choose a range by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/ivm/volume_table.h"

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

struct FieldStatistics {
  ValueHistogram histogram;
  VolumeTable volumes;  // what any range encloses
  [[nodiscard]] std::size_t memory_bytes() const {
    return sizeof *this + 8 * (histogram.count.size() + volumes.position.size() + volumes.below.size() + volumes.not_above.size());
  }
  friend bool operator==(const FieldStatistics&, const FieldStatistics&) = default;
};

}  // namespace intervale
