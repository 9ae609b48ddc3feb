#include "server/builder/find_keys.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "common/diamond/domain.h"
#include "common/patch/visit_samples.h"
#include "common/util/bits.h"
#include "server/builder/value_steps.h"

namespace intervale {
namespace {

// The keys of samples.
template <class T>
class KeyAt {
 public:
  KeyAt(std::span<const T> samples, const Domain& domain, const ValueFormat& format)
      : samples_(samples),
        domain_(domain),
        format_(format),
        row_(std::size_t(domain.last().x) + 1),
        slice_(row_ * (std::size_t(domain.last().y) + 1)) {}
  // Of the sample that a vertex clamps to.
  ValueKey operator()(Vertex v) const { return of(index(domain_.clamp(v))); }
  // Of a sample, by its place among the samples.
  [[nodiscard]] ValueKey of(std::size_t sample) const { return key_of_sample(format_, samples_[sample]); }
  [[nodiscard]] std::size_t index(Vertex v) const { return std::size_t(v.z) * slice_ + std::size_t(v.y) * row_ + std::size_t(v.x); }

 private:
  std::span<const T> samples_;
  const Domain& domain_;
  const ValueFormat& format_;
  std::size_t row_, slice_;
};

// The centre of a diamond. corner: of its supercube, with the least coordinates.
Vertex centre_from(Vertex corner, Slot slot, int scale) {
  const int type = kTypeOfSlot[slot];
  return {corner.x + ((type & 3) << scale), corner.y + ((type >> 2 & 3) << scale), corner.z + ((type >> 4 & 3) << scale)};
}

template <class T>
void find_in_brick(const KeyAt<T>& key, const Domain& domain, const SupercubeSet& set, BrickIndex brick, ValueKeys& keys, const SlotFilter& wanted) {
  const int scale = scale_of_key(set.bricks()[brick].key);
  std::array<std::size_t, kSlots> offset{};  // by slot, between samples
  for (Slot slot{0}; slot < kSlots; ++slot) offset[slot] = key.index(centre_from({}, slot, scale));
  set.for_each_supercube(brick, [&](SupercubeIndex supercube, SupercubeKey name) {
    const Vertex p = position_of_key(name), corner{p.x << (scale + 2), p.y << (scale + 2), p.z << (scale + 2)};
    const int furthest = 3 << scale;
    const bool is_inside = domain.contains({corner.x + furthest, corner.y + furthest, corner.z + furthest});
    const std::size_t first = is_inside ? key.index(corner) : 0;
    const std::uint64_t some = wanted ? wanted(name) : ~std::uint64_t(0);
    if (some == 0) return;
    UpdateIndex next = set.first(brick, supercube);
    for (const Slot slot : set_bits<Slot>(set.occupancy()[supercube])) {
      const UpdateIndex i = next++;
      if ((some >> std::uint32_t(slot) & 1) == 0) continue;
      keys.set(i, is_inside ? key.of(first + offset[slot]) : key(centre_from(corner, slot, scale)));
    }
  });
}

}  // namespace

void find_keys(const Volume& volume, const ValueFormat& format, const SupercubeSet& set, ValueKeys& keys) {
  find_keys({volume.type, volume.grid.dims, volume.bytes}, format, set, keys, {});
}

void find_keys(const SampleView& view, const ValueFormat& format, const SupercubeSet& set, ValueKeys& keys, const SlotFilter& wanted) {
  const Domain domain(view.dims);
  visit_samples(view.type, view.bytes, [&]<class T>(std::span<const T> samples) {
    const KeyAt<T> key(samples, domain, format);
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(set.bricks().size()),
                      [&](std::uint32_t brick) { find_in_brick(key, domain, set, BrickIndex(brick), keys, wanted); });
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

void drop_unused_values(ValueFormat& format, std::array<ValueKey, kRootVertices>& corners, ValueKeys& keys) {
  if (!format.table) return;
  const std::vector<double>& table = *format.table;
  std::vector<bool> is_used(table.size());
  is_used.front() = is_used.back() = true;
  for (const ValueKey key : corners) is_used[key] = true;
  for (std::size_t i = 0; i < keys.size(); ++i) is_used[keys[i]] = true;
  std::vector<ValueKey> rank(table.size());  // among those that are used
  std::vector<double> used;
  for (std::size_t key = 0; key < table.size(); ++key) {
    rank[key] = ValueKey(used.size());
    if (is_used[key]) used.push_back(table[key]);
  }
  for (ValueKey& key : corners) key = rank[key];
  ValueKeys ranked(keys.size(), ValueKey(used.size() - 1));
  for (std::size_t i = 0; i < keys.size(); ++i) ranked.set(i, rank[keys[i]]);
  keys = std::move(ranked);
  format = format_of_table(format.type, std::move(used));
}

bool has_exact_values(const Volume& volume, const ValueFormat& format) {
  if (!is_float(format.type)) return true;
  return visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    return std::all_of(samples.begin(), samples.end(), [&](T sample) { return format.value(format.key(double(sample))) == double(sample); });
  });
}

}  // namespace intervale
