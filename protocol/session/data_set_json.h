// What is told of a data set by HTTP, and to a page that shows a file.
#pragma once

#include <string>

#include "common/ivm/interval_volume.h"

namespace intervale {

// A line: the keys of common/program/describe.h, and if there are statistics of the field histogram, histogram_width and
// volumes{values below not_above} (value_histogram.h, volume_table.h).
[[nodiscard]] std::string data_set_json(const IntervalVolume& volume);

}  // namespace intervale
