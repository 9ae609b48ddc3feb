#include "server/builder/value_builder.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "common/ivm/value_page.h"
#include "server/builder/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/make_volume_table.h"
#include "server/builder/value_histogram.h"
#include "server/builder/value_steps.h"

namespace intervale {
namespace {

// The keys at the centres of all diamonds, and at the corners of the domain.
void find_keys(const Volume& volume, ValueVolume::Parts& parts) {
  const Domain domain(volume.grid.dims);
  const ValueFormat& format = parts.description.format;
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const auto key = [&](Vertex v) {
      const Vertex s = domain.clamp(v);
      const std::size_t x = std::size_t(s.x), y = std::size_t(s.y), z = std::size_t(s.z);
      return format.key(double(samples[(z * std::size_t(volume.grid.dims[1]) + y) * std::size_t(volume.grid.dims[0]) + x]));
    };
    const Diamond root(domain.root());
    for (int v = 0; v < kRootVertices; ++v) parts.description.corners[std::size_t(v)] = key(root.vertex(v));
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(parts.set.bricks().size()), [&](std::uint32_t brick) {
      parts.set.for_each_in_brick(BrickIndex(brick), ~std::uint64_t(0), [&](const Place& p) { parts.keys.set(p.index, key(parts.set.centre(p))); });
    });
  });
}

// Whether every sample is the value of its key.
bool has_exact_values(const Volume& volume, const ValueFormat& format) {
  return visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    return std::all_of(samples.begin(), samples.end(), [&](T sample) { return format.value(format.key(double(sample))) == double(sample); });
  });
}

}  // namespace

ValueVolume build_value_volume(Volume& volume, const ValueFormat& format, const std::function<void(double)>& progress) {
  const bool is_exact = !is_float(format.type) || has_exact_values(volume, format);
  round_samples(volume, format);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const FieldHierarchy hierarchy(volume, {{-kInfinity, kInfinity}, Refine::uniform, progress});
  ValueVolume::Parts parts;
  FieldDescription& d = parts.description;
  d.name = volume.name;
  d.grid = volume.grid;
  d.format = format;
  d.is_exact = is_exact;
  d.histogram = make_value_histogram(volume, format);
  d.volumes = make_volume_table(volume);
  parts.set = hierarchy.set();
  const std::uint32_t size = parts.set.size(), coarse = coarse_diamonds(parts.set);
  for (UpdateIndex i{0}; i < size; ++i) d.max_error = std::max(d.max_error, double(hierarchy.error(i)));
  parts.error_levels.resize(coarse);
  for (UpdateIndex i{0}; i < coarse; ++i) parts.error_levels[i] = ValueVolume::level_of_error(d.max_error, double(hierarchy.error(i)));
  parts.keys = ValueKeys(size, format.last);
  find_keys(volume, parts);
  parts.weights = fit_weights(parts, on_all_cores);
  return ValueVolume(std::move(parts));
}

}  // namespace intervale
