#include "common/ranges/find_relevant_updates.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "common/ivm/relevant_slots.h"
#include "common/patch/key_sides.h"
#include "common/ranges/error_to_distance.h"
#include "common/ranges/estimate_surface.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The surface below the first of these keys. All that have no value on one of their sides are the same, with no needs.
ShownRange surface_below(const ValueFormat& format, std::uint64_t key) {
  return {{format.value(key > format.last ? 0 : ValueKey(key)), kInfinity}, Refine::boundary};
}

// The range whose ends are values of keys, with the same values of keys inside.
Range between_keys(const ValueFormat& format, const Range& range) {
  const KeySides sides(format, range);
  Range result = range;
  if (std::isfinite(range.alpha) && sides.first_inside() <= format.last) result.alpha = format.value(ValueKey(sides.first_inside()));
  if (std::isfinite(range.beta) && sides.first_above() > 0) result.beta = format.value(ValueKey(sides.first_above() - 1));
  return result.alpha <= result.beta ? result : range;  // no key inside
}

}  // namespace

std::vector<RangePart> parts_of(const ValueFormat& format, const ShownRange& shown, Distances distances) {
  const auto [alpha, beta] = shown.range;
  const bool is_at_its_place = distances == Distances::measured && !has_few_keys(format);
  const KeySides sides(format, shown.range);
  std::vector<RangePart> parts;
  if (shown.refine == Refine::uniform || (alpha == -kInfinity && beta == kInfinity))
    parts.push_back({{between_keys(format, shown.range), shown.refine}, Distances::none});
  if (alpha != -kInfinity) {
    parts.push_back({is_at_its_place ? ShownRange{{alpha, kInfinity}, Refine::boundary} : surface_below(format, sides.first_inside()), distances});
  }
  if (beta != kInfinity) {
    parts.push_back({is_at_its_place ? ShownRange{{-kInfinity, beta}, Refine::boundary} : surface_below(format, sides.first_above()), distances});
  }
  return parts;
}

SurfaceErrors PartFinder::measure(const Range& range, const std::vector<std::uint64_t>& slots) {
  const SupercubeSet& all = volume_.set();
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  std::vector<std::uint8_t> steps;  // of those that are relevant
  std::vector<UpdateIndex> update;
  std::vector<SupercubeIndex> number;
  for (BrickIndex brick{0}; brick < all.bricks().size(); ++brick) {
    all.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      if (slots[s] == 0) return;
      keys.push_back(key);
      occupancy.push_back(slots[s]);
      number.push_back(s);
      for (const Slot slot : set_bits<Slot>(slots[s])) {
        update.push_back(all.first(brick, s) + count_below(all.occupancy()[s], slot));
        steps.push_back(std::uint8_t(volume_.error_step(update.back())));
      }
    });
  }
  SurfaceErrors result{std::vector<ErrorToDistance>(all.supercubes()), std::vector<std::uint8_t>(all.size()), std::vector<std::uint8_t>(all.size())};
  if (keys.empty()) return result;
  const SupercubeSet relevant(keys, std::move(occupancy));
  if (!field_) field_.emplace(volume_, parallel_);
  const auto found = measure_error_to_distance(
      field_->samples(), field_->surface_of(range), volume_.domain(), relevant,
      [&](UpdateIndex i) { return double(volume_.error_steps()[steps[i]]); }, volume_.description().max_error, true, parallel_);
  for (std::size_t i = 0; i < number.size(); ++i) result.to_distance[number[i]] = found.to_distance[i];
  for (std::size_t i = 0; i < update.size(); ++i) {
    result.slopes[update[i]] = found.slopes[i];
    result.distances[update[i]] = found.distances[i];
  }
  return result;
}

std::shared_ptr<const RelevantUpdates> PartFinder::find_measured(const RangePart& part) {
  const SupercubeSet& set = volume_.set();
  const RelevantSlots relevant(volume_, part.shown, parallel_);
  std::vector<std::uint64_t> slots(set.supercubes()), closed(set.supercubes());
  parallel_(set.bricks().size(), [&](std::size_t b) {
    const BrickIndex brick{std::uint32_t(b)};
    const SupercubeIndex first = set.bricks()[brick].first_supercube;
    const std::vector<std::uint64_t> with_ancestors = relevant.with_ancestors(brick), counting = relevant.of(brick);
    std::copy(with_ancestors.begin(), with_ancestors.end(), closed.begin() + first);
    std::copy(counting.begin(), counting.end(), slots.begin() + first);
  });
  const SurfaceErrors surface = measure(part.shown.range, closed);
  return std::make_shared<const RelevantUpdates>(volume_.description().grid, set, UpdateErrors{volume_.steps(), volume_.error_steps()},
                                                 ShownRanges{part.shown}, slots, surface);
}

std::shared_ptr<const RelevantUpdates> PartFinder::find(const RangePart& part) {
  if (part.distances == Distances::measured) return find_measured(part);
  const SupercubeSet& set = volume_.set();
  const auto slots = std::make_shared<const RelevantSlots>(volume_, part.shown, parallel_);
  const bool is_estimated = part.distances == Distances::estimated;
  std::array<EstimateBound, kMaxLevels> most;  // by scale
  for (int scale = 0; scale < kMaxLevels; ++scale) most[std::size_t(scale)] = bound_of_estimates(volume_.description().grid, scale);
  std::vector<RelevantUpdates::Bound> bounds(set.bricks().size());
  for (BrickIndex b{0}; b < bounds.size(); ++b) {
    const RelevantUpdates::Bound whole = volume_.relevant().bound(b);
    if (whole.updates == 0 || !slots->has_any(b)) continue;
    bounds[b] = {whole.updates, whole.error_step, 0, 0};
    if (!is_estimated) continue;
    const EstimateBound& estimates = most[std::size_t(scale_of_key(set.bricks()[b].key))];
    bounds[b].slope = estimates.slope;
    if (volume_.error_steps()[whole.error_step] > 0) bounds[b].object_error = estimates.distance;
  }
  const CountingKeys counts(KeySides(volume_.description().format, part.shown.range), part.shown.refine);
  const auto find_brick = [&volume = volume_, slots, counts, is_estimated](BrickIndex brick) {
    const std::vector<std::uint64_t> relevant = slots->of(brick);
    std::vector<BrickPart::Supercube> needs(relevant.size());
    for (std::size_t n = 0; n < needs.size(); ++n) needs[n].slots = relevant[n];
    BrickPart::Surface surface;
    if (is_estimated) {
      EstimatedSurface estimated = estimate_surface(volume, counts, brick, relevant);
      for (std::size_t n = 0; n < needs.size(); ++n) needs[n].to_distance = estimated.to_distance[n];
      surface = std::move(estimated.of_updates);
    }
    return BrickPart(volume.set(), brick, volume.steps(), needs, std::move(surface));
  };
  return std::make_shared<const RelevantUpdates>(volume_.description().grid, UpdateErrors{volume_.steps(), volume_.error_steps()},
                                                 ShownRanges{part.shown}, std::move(bounds),
                                                 RelevantUpdates::Known{is_estimated, is_estimated, false}, find_brick);
}

std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                             Distances distances, const FindPart& find) {
  const Description& d = volume->description();
  const std::shared_ptr<const RelevantUpdates> whole{volume, &volume->relevant()};
  std::vector<std::shared_ptr<const RelevantUpdates>> each;
  for (const ShownRange& one : shown) {
    if (one == d.whole()) {
      each.push_back(whole);
      continue;
    }
    for (const RangePart& part : parts_of(d.format, one, distances)) each.push_back(find(part));
  }
  if (each.size() == 1 && each.front()->shown() == shown) return each.front();
  return std::make_shared<const RelevantUpdates>(united(*volume, std::move(each), distinct(shown)));
}

std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                             Distances distances, const ParallelFor& parallel) {
  PartFinder finder(*volume, parallel);
  return find_relevant_updates(volume, shown, distances, [&](const RangePart& part) { return finder.find(part); });
}

}  // namespace intervale
