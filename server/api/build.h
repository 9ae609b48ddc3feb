// From volumes to data sets.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/api/data_set.h"
#include "common/patch/shown_range.h"
#include "common/patch/volume.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

// Another field on the grid of a volume, a scalar or a vector of 3, that meshes can bring along.
struct ChannelVolume {
  std::string name;  // UTF-8 of at most 64 bytes, other than surface, value and range
  Volume volume;
  std::optional<double> step = {};  // as DataSetOptions::step
};

struct DataSetOptions {
  // The closed range of values to keep; none: every range.
  std::optional<Range> range = {};
  // Of a range: its surfaces, or its inside, too.
  Refine refine = Refine::boundary;
  // Distance of the values that floats are rounded to, so that each is off by half of it at most; 0: exact. None: exact if
  // 65,536 steps are enough, else a power of two: 2,048 to 4,096 steps from the least to the greatest value.
  std::optional<double> step = {};
  // Replaces NaN and infinite samples; without it they are an error.
  std::optional<double> nan = {};
  // At most 16. Their samples are freed once they are built.
  std::vector<ChannelVolume> channels = {};
  // Called with the fraction done, 0 to 1, from any thread, one call at a time.
  std::function<void(double)> progress = {};
};

// volume: scalar; its name becomes the data set's. Uses all cores that oneTBB may.
[[nodiscard]] INTERVALE_EXPORT Result<DataSet> build_data_set(Volume volume, DataSetOptions options = {});

}  // namespace intervale
