// What a data set of every range tells of its field, to choose a range by.
#pragma once

#include <cstddef>

#include "common/ivm/value_histogram.h"
#include "common/ivm/volume_table.h"

namespace intervale {

struct FieldStatistics {
  ValueHistogram histogram;
  VolumeTable volumes;  // what any range encloses
  [[nodiscard]] std::size_t memory_bytes() const {
    return sizeof *this + 8 * (histogram.count.size() + volumes.position.size() + volumes.below.size() + volumes.not_above.size());
  }
  friend bool operator==(const FieldStatistics&, const FieldStatistics&) = default;
};

}  // namespace intervale
