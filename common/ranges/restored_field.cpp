#include "common/ranges/restored_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "common/patch/key_sides.h"
#include "common/util/atomic_ref.h"

namespace intervale {
namespace {

// Puts number(key) at each sample.
template <class T, class Number>
void fill(const IntervalVolume& from, std::vector<std::byte>& bytes, const ParallelFor& parallel, const Number& number) {
  const Domain& domain = from.domain();
  const auto row = std::size_t(domain.last().x) + 1, slice = row * (std::size_t(domain.last().y) + 1);
  bytes.resize(slice * (std::size_t(domain.last().z) + 1) * sizeof(T));
  T* const samples = reinterpret_cast<T*>(bytes.data());
  // Where the box clamps several centres to a sample, all of them have its key.
  const auto put = [&](Vertex v, ValueKey key) {
    const Vertex s = domain.clamp(v);
    AtomicRef<T>(samples[std::size_t(s.z) * slice + std::size_t(s.y) * row + std::size_t(s.x)]).store(number(key), std::memory_order_relaxed);
  };
  const Diamond root(domain.root());
  for (int v = 0; v < kRootVertices; ++v) put(root.vertex(v), from.description().corners[std::size_t(v)]);
  parallel(from.set().bricks().size(), [&](std::size_t b) {
    from.set().for_each_in_brick(BrickIndex(std::uint32_t(b)), ~std::uint64_t(0),
                                 [&](const Place& p) { put(SupercubeSet::centre(p), from.key(p.index)); });
  });
}

}  // namespace

RestoredField::RestoredField(const IntervalVolume& from, const ParallelFor& parallel)
    : format_(from.description().format),
      is_in_keys_(format_.step != 0 && from.keys().width() <= 2),
      samples_{from.description().name, from.description().grid, SampleType::f64, {}} {
  if (is_in_keys_ && from.keys().width() == 1) {
    samples_.type = SampleType::u8;
    fill<std::uint8_t>(from, samples_.bytes, parallel, [](ValueKey key) { return std::uint8_t(key); });
  } else if (is_in_keys_) {
    samples_.type = SampleType::u16;
    fill<std::uint16_t>(from, samples_.bytes, parallel, [](ValueKey key) { return std::uint16_t(key); });
  } else {
    fill<double>(from, samples_.bytes, parallel, [&](ValueKey key) { return format_.value(key); });
  }
}

Range RestoredField::surface_of(const Range& range) const {
  const KeySides sides(format_, range);
  const std::uint64_t inside = sides.first_inside(), above = sides.first_above();
  if (has_few_keys(format_)) {
    const std::uint64_t end = std::isfinite(range.alpha) ? inside : above;
    if (end == 0 || end > format_.last) return range;  // no value is on its other side
    // Nearly at the two values: a point at a sample could go to any of the tetrahedra around it.
    constexpr double kNearly = 1.0 / 64;
    if (is_in_keys_) return {double(end) - kNearly, double(end) - 1 + kNearly};
    const double low = format_.value(ValueKey(end - 1)), high = format_.value(ValueKey(end));
    return {std::lerp(low, high, 1 - kNearly), std::lerp(low, high, kNearly)};
  }
  if (!is_in_keys_) return range;
  const auto in_keys = [&](double bound, double least, double greatest) {
    return std::isinf(bound) ? bound : std::clamp(bound / format_.step - double(format_.first), least, greatest);
  };
  // Every key keeps its side.
  constexpr double kLess = 1 - 1e-6;
  return {in_keys(range.alpha, double(inside) - kLess, double(inside)), in_keys(range.beta, double(above) - 1, double(above) - 1 + kLess)};
}

}  // namespace intervale
