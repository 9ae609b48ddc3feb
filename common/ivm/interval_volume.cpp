#include "common/ivm/interval_volume.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>

namespace intervale {
namespace {

std::uint64_t hash(const void* data, std::size_t bytes, std::uint64_t seed) { return XXH3_64bits_withSeed(data, bytes, seed); }

template <class T>
std::uint64_t hash(std::span<const T> values, std::uint64_t seed) {
  return hash(values.data(), values.size_bytes(), seed);
}

std::uint64_t content_hash(const Description& d, const IntervalVolume::Parts& parts) {
  std::uint64_t h = 0;
  h = hash(std::span<const std::int32_t>(d.grid.dims), h);
  h = hash(std::span<const double>(d.grid.affine.rows), h);
  const double range[2] = {d.range.alpha, d.range.beta};
  h = hash(range, sizeof range, h);
  const double step = d.format.step;
  h = hash(&step, sizeof step, h);
  const std::uint64_t format[4] = {std::uint64_t(d.format.type), std::uint64_t(d.format.first), d.format.last, std::uint64_t(d.is_exact)};
  h = hash(format, sizeof format, h);
  if (d.format.table) h = hash(std::span<const double>(*d.format.table), h);
  h = hash(std::span<const ValueKey>(d.corners), h);
  h = hash(&d.weights, sizeof d.weights, h);
  for (const SupercubeSet::Brick& b : parts.set.bricks()) {
    const std::uint64_t brick[2] = {b.key, b.mask};
    h = hash(brick, sizeof brick, h);
  }
  h = hash(parts.set.occupancy(), h);
  h = hash(parts.keys.bytes(), h);
  h = hash(std::span<const std::uint8_t>(parts.steps), h);
  h = hash(std::span<const float>(parts.error_steps), h);
  return hash(std::span<const ErrorToDistance>(parts.error_to_distance), h);
}

}  // namespace

IntervalVolume::IntervalVolume(Parts parts)
    : description_(std::move(parts.description)),
      domain_(description_.grid.dims),
      set_(std::move(parts.set)),
      keys_(std::move(parts.keys)),
      steps_(std::move(parts.steps)),
      error_steps_(std::move(parts.error_steps)),
      relevant_(description_.grid, set_, {steps_, error_steps_}, description_.whole(), {}, std::move(parts.error_to_distance)),
      statistics_(std::move(parts.statistics)) {}

Result<IntervalVolume> IntervalVolume::assemble(Parts parts) {
  const Description& d = parts.description;
  if (auto ok = check_description(d); !ok) return tl::unexpected(ok.error());
  if (parts.keys.size() != parts.set.size() || parts.steps.size() != parts.set.size() || parts.error_to_distance.size() != parts.set.supercubes())
    return fail("the numbers of values, errors or supercubes do not match the set");
  if (parts.error_steps.size() > kMaxErrorSteps || (parts.error_steps.empty() && !parts.steps.empty()))
    return fail("the number of errors is out of range");
  for (std::size_t i = 0; i < parts.error_steps.size(); ++i) {
    if (!std::isfinite(parts.error_steps[i]) || parts.error_steps[i] < (i == 0 ? 0.0f : parts.error_steps[i - 1]))
      return fail("errors do not ascend");
  }
  const int levels = Domain(d.grid.dims).levels();
  for (const SupercubeSet::Brick& brick : parts.set.bricks()) {
    if (scale_of_key(brick.key) >= levels) return fail("a brick is coarser than the box");
  }
  for (const std::uint16_t step : parts.steps) {
    if (step >= parts.error_steps.size()) return fail("an update's error is out of range");
  }
  for (std::size_t i = 0; i < parts.keys.size(); ++i) {
    if (parts.keys[i] > d.format.last) return fail("an update's value is out of range");
  }
  parts.description.updates = parts.set.size();
  parts.description.content_hash = content_hash(d, parts);
  return IntervalVolume(std::move(parts));
}

std::size_t IntervalVolume::memory_bytes() const {
  return sizeof *this + description_.format.memory_bytes() + set_.memory_bytes() + keys_.memory_bytes() + steps_.size() +
         error_steps_.size() * sizeof(float) + relevant_.memory_bytes() + (statistics_ ? statistics_->memory_bytes() : 0);
}

}  // namespace intervale
