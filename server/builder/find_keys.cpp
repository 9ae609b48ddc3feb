#include "server/builder/find_keys.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <span>

#include "common/diamond/domain.h"

namespace intervale {
namespace {

// The key of the sample at a vertex, which is clamped to the box.
template <class T>
class KeyAt {
 public:
  KeyAt(std::span<const T> samples, const Domain& domain, const ValueFormat& format)
      : samples_(samples),
        domain_(domain),
        format_(format),
        row_(std::size_t(domain.last().x) + 1),
        slice_(row_ * (std::size_t(domain.last().y) + 1)) {}
  ValueKey operator()(Vertex v) const {
    const Vertex s = domain_.clamp(v);
    return format_.key(double(samples_[std::size_t(s.z) * slice_ + std::size_t(s.y) * row_ + std::size_t(s.x)]));
  }

 private:
  std::span<const T> samples_;
  const Domain& domain_;
  const ValueFormat& format_;
  std::size_t row_, slice_;
};

}  // namespace

void find_keys(const Volume& volume, const ValueFormat& format, const SupercubeSet& set, ValueKeys& keys) {
  const Domain domain(volume.grid.dims);
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const KeyAt<T> key(samples, domain, format);
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(set.bricks().size()), [&](std::uint32_t brick) {
      set.for_each_in_brick(BrickIndex(brick), ~std::uint64_t(0), [&](const Place& p) { keys.set(p.index, key(SupercubeSet::centre(p))); });
    });
  });
}

std::array<ValueKey, kRootVertices> corner_keys(const Volume& volume, const ValueFormat& format) {
  const Domain domain(volume.grid.dims);
  const Diamond root(domain.root());
  std::array<ValueKey, kRootVertices> keys{};
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const KeyAt<T> key(samples, domain, format);
    for (int v = 0; v < kRootVertices; ++v) keys[std::size_t(v)] = key(root.vertex(v));
  });
  return keys;
}

bool has_exact_values(const Volume& volume, const ValueFormat& format) {
  if (!is_float(format.type)) return true;
  return visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    return std::all_of(samples.begin(), samples.end(), [&](T sample) { return format.value(format.key(double(sample))) == double(sample); });
  });
}

}  // namespace intervale
