#include "common/ranges/find_relevant_updates.h"

#include <algorithm>
#include <array>
#include <bit>
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

namespace {

// What a part needs of a brick.
struct NeededSlots {
  std::vector<std::uint64_t> counting, closed;  // by supercube; closed: with ancestors; empty: it has none of those
  std::size_t first_supercube = 0;              // of those that have any, and of their updates, so many are in bricks before
  UpdateIndex first;
};

std::vector<NeededSlots> needed_slots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel) {
  const RelevantSlots relevant(volume, shown, parallel);
  std::vector<NeededSlots> all(volume.set().bricks().size());
  parallel(all.size(), [&](std::size_t b) {
    const BrickIndex brick{std::uint32_t(b)};
    if (!relevant.has_any(brick)) return;
    std::vector<std::uint64_t> closed = relevant.with_ancestors(brick);
    if (std::all_of(closed.begin(), closed.end(), [](std::uint64_t slots) { return slots == 0; })) return;
    all[b].closed = std::move(closed);
    all[b].counting = relevant.of(brick);
  });
  return all;
}

}  // namespace

std::shared_ptr<const RelevantUpdates> PartFinder::find_measured(const RangePart& part) {
  const SupercubeSet& set = volume_.set();
  std::vector<NeededSlots> needed = needed_slots(volume_, part.shown, parallel_);
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  UpdateIndex end{0};
  for (BrickIndex b{0}; b < needed.size(); ++b) {
    NeededSlots& of_brick = needed[b];
    if (of_brick.closed.empty()) continue;
    of_brick.first_supercube = keys.size();
    of_brick.first = end;
    std::size_t n = 0;
    set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey key) {
      const std::uint64_t slots = of_brick.closed[n++];
      if (slots == 0) return;
      keys.push_back(key);
      occupancy.push_back(slots);
      end = end + std::uint32_t(std::popcount(slots));
    });
  }
  const SupercubeSet relevant(keys, std::move(occupancy));
  keys = {};
  std::vector<std::uint8_t> steps(relevant.size());
  parallel_(needed.size(), [&](std::size_t b) {
    const NeededSlots& of_brick = needed[b];
    UpdateIndex to = of_brick.first;
    std::size_t n = 0;
    if (of_brick.closed.empty()) return;
    set.for_each_supercube(BrickIndex(std::uint32_t(b)), [&](SupercubeIndex s, SupercubeKey) {
      const UpdateIndex first = set.first(BrickIndex(std::uint32_t(b)), s);
      for (const Slot slot : set_bits<Slot>(of_brick.closed[n++]))
        steps[to++] = std::uint8_t(volume_.error_step(first + count_below(set.occupancy()[s], slot)));
    });
  });
  SurfaceErrors surface;
  if (relevant.size() > 0) {
    if (!field_) field_.emplace(volume_, parallel_);
    surface = measure_error_to_distance(
        field_->samples(), field_->surface_of(part.shown.range), volume_.domain(), relevant,
        [&](UpdateIndex i) { return double(volume_.error_steps()[steps[i]]); }, volume_.description().max_error, true, parallel_);
  }
  const bool is_far = std::any_of(surface.to_distance.begin(), surface.to_distance.end(), [](ErrorToDistance code) { return code.is_far(); });
  const auto find_brick = [&](BrickIndex b) -> std::optional<BrickPart> {
    const NeededSlots& of_brick = needed[b];
    if (of_brick.closed.empty()) return {};
    std::vector<BrickPart::Supercube> needs(of_brick.closed.size());
    BrickPart::Surface of_updates;
    std::size_t updates = 0;
    for (const std::uint64_t slots : of_brick.counting) updates += std::size_t(std::popcount(slots));
    of_updates.slopes.reserve(updates);
    of_updates.distances.reserve(updates);
    std::size_t supercube = of_brick.first_supercube;
    UpdateIndex first = of_brick.first;
    for (std::size_t n = 0; n < needs.size(); ++n) {
      const std::uint64_t closed = of_brick.closed[n];
      if (closed == 0) continue;
      needs[n] = {of_brick.counting[n], surface.to_distance[supercube++]};
      for (const Slot slot : set_bits<Slot>(needs[n].slots)) {
        const UpdateIndex i = first + count_below(closed, slot);
        of_updates.slopes.push_back(surface.slopes[i]);
        of_updates.distances.push_back(surface.distances[i]);
      }
      first = first + std::uint32_t(std::popcount(closed));
    }
    return BrickPart(set, b, volume_.steps(), needs, std::move(of_updates));
  };
  return std::make_shared<const RelevantUpdates>(volume_.description().grid, set, UpdateErrors{volume_.steps(), volume_.error_steps()},
                                                 ShownRanges{part.shown}, RelevantUpdates::Known{true, true, is_far}, find_brick, parallel_);
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
