#include "server/builder/value_builder.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/ivm/value_page.h"
#include "common/parallel/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/find_keys.h"
#include "server/builder/make_volume_table.h"
#include "server/builder/value_histogram.h"
#include "server/builder/value_steps.h"

namespace intervale {
ValueVolume build_value_volume(Volume& volume, const ValueFormat& format, const std::function<void(double)>& progress, KeptErrors* kept) {
  const bool is_exact = has_exact_values(volume, format);
  round_samples(volume, format);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ValueVolume::Parts parts;
  FieldDescription& d = parts.description;
  d.name = volume.name;
  d.grid = volume.grid;
  d.labels = volume.labels;
  d.format = format;
  d.is_exact = is_exact;
  d.statistics.histogram = make_value_histogram(volume, format);
  d.statistics.volumes = make_volume_table(volume);
  {  // four bytes a diamond, which are freed before keys are found
    const FieldHierarchy hierarchy(volume, {{-kInfinity, kInfinity}, Refine::uniform, progress, kept});
    parts.set = hierarchy.set();
    const std::size_t size = parts.set.size(), coarse = coarse_diamonds(parts.set);
    for (UpdateIndex i{0}; i < size; ++i) d.max_error = std::max(d.max_error, double(hierarchy.error(i)));
    parts.error_levels.resize(coarse);
    for (UpdateIndex i{0}; i < coarse; ++i) parts.error_levels[i] = ValueVolume::level_of_error(d.max_error, double(hierarchy.error(i)));
  }
  parts.keys = ValueKeys(parts.set.size(), format.last);
  find_keys(volume, format, parts.set, parts.keys);
  d.corners = corner_keys(volume, format);
  parts.weights = fit_weights(parts, on_all_cores);
  return ValueVolume(std::move(parts));
}

}  // namespace intervale
