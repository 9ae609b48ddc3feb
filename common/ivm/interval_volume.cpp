#include "common/ivm/interval_volume.h"

#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

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
  h = hash(std::span<const double>(d.grid.spacing), h);
  h = hash(std::span<const double>(d.grid.origin), h);
  const double range[2] = {d.range.alpha, d.range.beta};
  h = hash(range, sizeof range, h);
  const double step = d.format.step;
  h = hash(&step, sizeof step, h);
  const std::uint64_t format[4] = {std::uint64_t(d.format.type), std::uint64_t(d.format.first), d.format.last, std::uint64_t(d.is_exact)};
  h = hash(format, sizeof format, h);
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

// Codes an octave, the code of a ratio of 1, and the code without a bound. Both near and far ratios go from 2^-12 to
// 2^20.
constexpr int kNearSteps = 6, kNearOne = 72, kNoBound = 191;
constexpr int kFarSteps = 2, kFarOne = 216, kFirstFar = 192, kNoBoundFar = 255;

}  // namespace

ErrorToDistance ErrorToDistance::at_least(double ratio, double unit, bool is_far) {
  if (!(ratio > 0)) return ErrorToDistance(0);
  const auto code = [&](int steps, int one) { return std::ceil(steps * std::log2(ratio / unit) - 1e-9) + one; };
  if (is_far) return ErrorToDistance(std::uint8_t(std::clamp(code(kFarSteps, kFarOne), double(kFirstFar), double(kNoBoundFar))));
  return ErrorToDistance(std::uint8_t(std::clamp(code(kNearSteps, kNearOne), 1.0, double(kNoBound))));
}

bool ErrorToDistance::is_far() const { return code_ >= kFirstFar; }

float ErrorToDistance::ratio(float unit) const {
  if (code_ == 0) return 0;
  if (code_ == kNoBound || code_ == kNoBoundFar) return std::numeric_limits<float>::max();
  if (is_far()) return unit * std::exp2(float(int(code_) - kFarOne) / kFarSteps);
  return unit * std::exp2(float(int(code_) - kNearOne) / kNearSteps);
}

double error_to_distance_unit(const Grid& grid, double max_error) {
  return max_error > 0 ? std::min({grid.spacing[0], grid.spacing[1], grid.spacing[2]}) / max_error : 1.0;
}

double diamond_width(const Grid& grid) { return 2 * std::hypot(grid.spacing[0], grid.spacing[1], grid.spacing[2]); }

IntervalVolume::IntervalVolume(Parts parts)
    : description_(std::move(parts.description)),
      domain_(description_.grid.dims),
      set_(std::move(parts.set)),
      keys_(std::move(parts.keys)),
      steps_(std::move(parts.steps)),
      error_steps_(std::move(parts.error_steps)),
      error_to_distance_(std::move(parts.error_to_distance)),
      reach_(float(diamond_width(description_.grid) / 2)) {
  const auto unit = float(error_to_distance_unit(description_.grid, error_steps_.empty() ? 0.0 : double(error_steps_.back())));
  for (unsigned code = 0; code < factor_.size(); ++code) factor_[code] = ErrorToDistance(std::uint8_t(code)).ratio(unit);
  brick_object_error_.resize(set_.bricks().size());
  supercube_step_.reserve(set_.supercubes());
  brick_step_.reserve(set_.bricks().size());
  for (BrickIndex b{0}; b < set_.bricks().size(); ++b) {
    brick_step_.push_back(0);
    set_.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const UpdateIndex first = set_.first(b, s), end = first + std::popcount(set_.occupancy()[s]);
      std::uint8_t most = 0;
      for (UpdateIndex i = first; i < end; ++i) most = std::max(most, steps_[i]);
      supercube_step_.push_back(most);
      brick_step_[b] = std::max(brick_step_[b], most);
      brick_object_error_[b] = std::max(brick_object_error_[b], object_error(s, scale_of_key(key), most));
    });
  }
}

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
  return sizeof *this + set_.memory_bytes() + keys_.memory_bytes() + steps_.size() + brick_step_.size() + brick_object_error_.size() * 4 +
         error_to_distance_.size() + supercube_step_.size() + error_steps_.size() * sizeof(float);
}

}  // namespace intervale
