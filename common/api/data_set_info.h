// What a data set is of.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/diamond/grid.h"
#include "common/patch/labels.h"
#include "common/patch/shown_range.h"

namespace intervale {

struct ChannelInfo {
  std::string name;
  std::string unit;         // empty if it is not known
  unsigned components = 1;  // 1, or 3 of a vector
};

struct DataSetInfo {
  std::string name;
  Grid grid;      // of the volume's samples
  Labels labels;  // what lengths and values are in
  // The range of values that it was built for; none: it has every range.
  std::optional<ShownRange> shown;
  Range values;               // the least and the greatest value that the data set can hold
  double max_error = 0;       // the largest error of an update, in the field's units: Lod::error_percent is of this
  std::uint64_t updates = 0;  // refinement steps that it has
  std::uint64_t tets = 0;     // of the mesh at error 0; 0 of every range
  std::vector<ChannelInfo> channels;
};

}  // namespace intervale
