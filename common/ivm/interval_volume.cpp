#include "common/ivm/interval_volume.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cassert>
#include <cmath>
#include <mutex>

#include "common/ivm/paged_values.h"
#include "common/ivm/relevant_slots.h"
#include "common/ivm/value_bounds.h"

namespace intervale {

struct IntervalVolume::LazyBounds {
  std::mutex finding;
  std::optional<ValueBounds> found;
  std::atomic<std::size_t> bytes = 0;  // of what was found
};

namespace {

std::vector<ScreenError::Region> regions_of_bricks(const Domain& domain, const SupercubeSet& set) {
  std::vector<ScreenError::Region> regions;
  regions.reserve(set.bricks().size());
  for (const SupercubeSet::Brick& brick : set.bricks()) regions.push_back(region_of(domain, brick.key, 4));
  return regions;
}

// The least boxes around those of each run.
std::vector<ScreenError::Region> regions_of_runs(const std::vector<ScreenError::Region>& bricks) {
  std::vector<ScreenError::Region> regions;
  for (std::size_t begin = 0; begin < bricks.size(); begin += RelevantUpdates::kRun) {
    const std::size_t end = std::min(bricks.size(), begin + RelevantUpdates::kRun);
    ScreenError::Region region;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = bricks[begin].middle[axis] - bricks[begin].reach[axis], high = bricks[begin].middle[axis] + bricks[begin].reach[axis];
      for (std::size_t b = begin + 1; b < end; ++b) {
        low = std::min(low, bricks[b].middle[axis] - bricks[b].reach[axis]);
        high = std::max(high, bricks[b].middle[axis] + bricks[b].reach[axis]);
      }
      region.middle[axis] = (low + high) / 2;
      region.reach[axis] = (high - low) / 2;
    }
    regions.push_back(region);
  }
  return regions;
}

// What counts for the data set's range, but for lost updates; empty: all. left: see IntervalVolume::Parts.
std::vector<std::uint64_t> relevant_slots(const IntervalVolume& volume, const std::vector<std::uint64_t>& left) {
  const Description& d = volume.description();
  if (d.has_every_range) return left;
  std::vector<std::uint64_t> slots = counting_slots(volume, CountingKeys(KeySides(d.format, d.range), d.refine));
  for (std::size_t s = 0; s < left.size(); ++s) slots[s] &= left[s];
  return slots;
}

// Errors are saturated: an update's is no smaller than that of any child. The parents of a scale's first level are of
// the last level of the scale before, and each of its other levels has its parents in the level before it. So no update
// of a finer scale has a greater error than those of the last level of the finest scale that is there.
float error_of_last_level(const IntervalVolume& volume) {
  const SupercubeSet& set = volume.set();
  unsigned step = 0;
  set.for_each(scale_of_key(set.bricks().back().key), 2, [&](const Place& p) { step = std::max(step, volume.error_step(p.index)); });
  return volume.error_steps()[step];
}

}  // namespace

IntervalVolume::IntervalVolume(Parts parts, const BrickRegions& regions, const ParallelFor& parallel)
    : description_(std::move(parts.description)),
      domain_(description_.grid.dims),
      set_(std::move(parts.set)),
      keys_(std::move(parts.keys)),
      steps_(std::move(parts.steps)),
      error_steps_(std::move(parts.error_steps)),
      left_(std::move(parts.left)),
      relevant_(description_.grid, set_, {steps_, error_steps_}, ShownRanges{description_.whole()}, relevant_slots(*this, left_), parts.surface,
                parallel),
      brick_regions_(description_.grid, regions),
      run_regions_(description_.grid, regions_of_runs(regions)),
      bounds_(std::make_shared<LazyBounds>()),
      statistics_(std::move(parts.statistics)) {
  if (!is_whole() && size() != 0) error_of_finer_ = error_of_last_level(*this);
}

Result<IntervalVolume> IntervalVolume::assemble(Parts parts, const ParallelFor& parallel) {
  const Description& d = parts.description;
  if (auto ok = check_description(d); !ok) return tl::unexpected(ok.error());
  if (parts.keys.size() != parts.set.size() || parts.steps.size() != parts.set.size() || parts.surface.to_distance.size() != parts.set.supercubes() ||
      (!parts.left.empty() && parts.left.size() != parts.set.supercubes()) ||
      (!parts.surface.slopes.empty() && parts.surface.slopes.size() != parts.set.size()) ||
      (!parts.surface.distances.empty() && parts.surface.distances.size() != parts.set.size()))
    return fail("the numbers of values, errors or supercubes do not match the set");
  if (std::any_of(parts.surface.slopes.begin(), parts.surface.slopes.end(), [](std::uint8_t slope) { return slope > kMaxSlope; }))
    return fail("a slope is out of range");
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
  std::atomic<bool> has_wrong_error = false, has_wrong_value = false;
  parallel(parts.set.bricks().size(), [&](std::size_t b) {
    const BrickIndex brick{std::uint32_t(b)};
    const std::size_t first = parts.set.bricks()[brick].first, end = first + parts.set.updates(brick);
    bool is_wrong = false;
    for (std::size_t i = first; i < end; ++i) is_wrong |= parts.steps[i] >= parts.error_steps.size();
    if (is_wrong) has_wrong_error = true;
    is_wrong = false;
    for (std::size_t i = first; i < end; ++i) is_wrong |= parts.keys[i] > d.format.last;
    if (is_wrong) has_wrong_value = true;
  });
  if (has_wrong_error) return fail("an update's error is out of range");
  if (has_wrong_value) return fail("an update's value is out of range");
  parts.description.updates = std::uint64_t(parts.set.size()) + parts.finer;
  const BrickRegions regions = regions_of_bricks(Domain(d.grid.dims), parts.set);
  return IntervalVolume(std::move(parts), regions, parallel);
}

const ValueBounds& IntervalVolume::bounds(const ParallelFor& parallel) const {
  assert(description_.refine == Refine::uniform && "it has other ranges");
  const std::lock_guard lock(bounds_->finding);
  if (!bounds_->found) bounds_->bytes = bounds_->found.emplace(PagedValues(*this), parallel).memory_bytes();
  return *bounds_->found;
}

bool IntervalVolume::has_bounds() const { return bounds_->bytes != 0; }

Result<void> IntervalVolume::set_channels(std::vector<Channel> channels, std::vector<ChannelKeys> keys) {
  if (auto valid = check_channels(channels); !valid) return valid;
  bool fits = keys.size() == channels.size();
  for (std::size_t i = 0; fits && i < channels.size(); ++i) {
    fits = keys[i].size() == channels[i].components.size();
    for (std::size_t c = 0; fits && c < keys[i].size(); ++c) {
      fits = keys[i][c].size() == size();
      for (std::size_t k = 0; fits && k < size(); ++k) fits = keys[i][c][k] <= channels[i].components[c].format.last;
    }
  }
  if (!fits) return fail("the values of a channel do not fit the data set");
  description_.channels = std::move(channels);
  channel_keys_ = std::move(keys);
  return {};
}

std::uint64_t IntervalVolume::lost_updates() const {
  std::uint64_t lost = 0;
  for (std::size_t s = 0; s < left_.size(); ++s) lost += std::uint64_t(std::popcount(set_.occupancy()[s] & ~left_[s]));
  return lost;
}

std::size_t IntervalVolume::memory_bytes() const {
  std::size_t of_channels = 0;
  for (const ChannelKeys& channel : channel_keys_) {
    for (const ValueKeys& keys : channel) of_channels += keys.memory_bytes();
  }
  return of_channels + sizeof *this + description_.format.memory_bytes() + set_.memory_bytes() + keys_.memory_bytes() + steps_.size() +
         error_steps_.size() * sizeof(float) + left_.size() * sizeof(std::uint64_t) + relevant_.memory_bytes() + brick_regions_.memory_bytes() +
         run_regions_.memory_bytes() + bounds_->bytes + (statistics_ ? statistics_->memory_bytes() : 0);
}

}  // namespace intervale
