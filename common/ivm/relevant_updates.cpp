#include "common/ivm/relevant_updates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"

namespace intervale {

RelevantUpdates::RelevantUpdates(const Grid& grid, const UpdateErrors& errors, ShownRanges shown, std::vector<Bound> bounds, Known known, Find find)
    : shown_(std::move(shown)),
      bounds_(std::move(bounds)),
      error_(errors.values.begin(), errors.values.end()),
      reach_(float(diamond_width(grid) / 2)),
      known_(known),
      found_(std::make_shared<Found>(bounds_.size(), std::move(find))) {
  const auto unit = float(error_to_distance_unit(grid, error_.empty() ? 0.0 : double(error_.back())));
  for (unsigned code = 0; code < factor_.size(); ++code) {
    factor_[code] = ErrorToDistance(std::uint8_t(code)).ratio(unit);
    distance_of_[code] = distance_of(std::uint8_t(code), diamond_width(grid));
  }
}

RelevantUpdates::RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown,
                                 const std::vector<std::uint64_t>& slots, const SurfaceErrors& surface)
    : RelevantUpdates(grid, errors, std::move(shown), std::vector<Bound>(set.bricks().size()),
                      {!surface.slopes.empty(), !surface.distances.empty(),
                       std::any_of(surface.to_distance.begin(), surface.to_distance.end(), [](ErrorToDistance code) { return code.is_far(); })},
                      {}) {
  std::vector<BrickNeeds::Supercube> needs;
  for (BrickIndex b{0}; b < bounds_.size(); ++b) {
    needs.clear();
    BrickNeeds::Surface of_updates;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
      const std::uint64_t occupancy = set.occupancy()[s];
      needs.push_back({slots.empty() ? occupancy : slots[s], surface.to_distance[s]});
      for (const Slot slot : set_bits<Slot>(has_slopes() || has_distances() ? needs.back().slots : 0)) {
        const UpdateIndex i = set.first(b, s) + count_below(occupancy, slot);
        if (has_slopes()) of_updates.slopes.push_back(surface.slopes[i]);
        if (has_distances()) of_updates.distances.push_back(surface.distances[i]);
      }
    });
    const BrickNeeds& brick = found_->bricks.keep(b, BrickNeeds(set, b, errors.steps, needs, std::move(of_updates))).value;
    found_->bytes += brick.memory_bytes();
    bounds_[b].updates = std::uint16_t(brick.updates());
    const int scale = scale_of_key(set.bricks()[b].key);
    for (std::size_t n = 0; n < needs.size(); ++n) {
      if (needs[n].slots == 0) continue;
      bounds_[b].error_step = std::max(bounds_[b].error_step, brick.error_step(n));
      bounds_[b].slope = std::max(bounds_[b].slope, brick.slope(n));
      bounds_[b].object_error = std::max(bounds_[b].object_error, object_error(brick.to_distance(n), scale, brick.error_step(n), brick.distance(n)));
    }
  }
}

const BrickNeeds& RelevantUpdates::Found::find_now(BrickIndex brick) {
  const auto [kept, is_new] = bricks.keep(brick, find(brick));
  if (is_new) {
    bytes += kept.memory_bytes();
    if (on_growth) on_growth();
  }
  return kept;
}

std::size_t RelevantUpdates::memory_bytes() const {
  return sizeof *this + bounds_.size() * (sizeof(Bound) + sizeof(void*)) + error_.size() * sizeof(float) + found_->bytes;
}

namespace {

// What is united, and where.
struct Union {
  const IntervalVolume& volume;
  std::vector<std::shared_ptr<const RelevantUpdates>> each;
  RelevantUpdates::Known known;

  [[nodiscard]] BrickNeeds operator()(BrickIndex b) const;
  [[nodiscard]] RelevantUpdates::Bound bound(BrickIndex b) const;
};

BrickNeeds Union::operator()(BrickIndex b) const {
  struct Part {
    const RelevantUpdates& of;
    const BrickNeeds& needs;
  };
  const SupercubeSet& set = volume.set();
  std::vector<Part> parts;
  std::vector<const BrickNeeds*> needs_of_parts;
  bool are_alike = true;
  for (const auto& one : each) {
    if (one->bound(b).updates == 0) continue;
    parts.push_back({*one, one->brick(b)});
    parts.back().needs.add_parts(needs_of_parts);
    are_alike = are_alike && one->has_slopes() == known.slopes && one->has_distances() == known.distances;
  }
  if (are_alike && !parts.empty() && needs_of_parts.size() <= BrickNeeds::kMostParts) return {set, b, std::move(needs_of_parts)};
  const double width = diamond_width(volume.description().grid);
  const int scale = scale_of_key(set.bricks()[b].key);
  std::vector<BrickNeeds::Supercube> needs;
  BrickNeeds::Surface surface;
  std::array<std::uint8_t, kSlots> slopes{}, distances{};  // those of relevant slots are set
  std::size_t n = 0;
  set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
    const std::uint64_t occupancy = set.occupancy()[s];
    BrickNeeds::Supercube all;
    for (const Part& part : parts) {
      all.slots |= part.needs.slots(n, occupancy);
      all.to_distance = ErrorToDistance::farther(all.to_distance, part.needs.to_distance(n), scale);
    }
    needs.push_back(all);
    if (known.slopes || known.distances) {
      for (const Slot slot : set_bits<Slot>(all.slots)) slopes[slot] = distances[slot] = 0;
      for (const Part& part : parts) {
        const std::uint64_t slots = part.needs.slots(n, occupancy);
        for (const Slot slot : set_bits<Slot>(slots)) {
          const BrickNeeds::OfUpdate own = part.needs.of_update(n, slots, slot);
          slopes[slot] = std::max(slopes[slot], own.slope);
          std::uint8_t distance = own.distance;
          if (!part.of.has_distances()) {
            const unsigned step = volume.error_step(set.first(b, s) + count_below(occupancy, slot));
            distance = distance_at_least(double(part.of.object_error(all.to_distance, scale, step)), width);
          }
          distances[slot] = std::max(distances[slot], distance);
        }
      }
      for (const Slot slot : set_bits<Slot>(all.slots)) {
        if (known.slopes) surface.slopes.push_back(slopes[slot]);
        if (known.distances) surface.distances.push_back(distances[slot]);
      }
    }
    ++n;
  });
  return {set, b, volume.steps(), needs, std::move(surface)};
}

// Where not all have distances, the code of one meets the errors of another: nothing but the reach of codes bounds that.
RelevantUpdates::Bound Union::bound(BrickIndex b) const {
  RelevantUpdates::Bound all;
  unsigned updates = 0;
  for (const auto& one : each) {
    const RelevantUpdates::Bound& part = one->bound(b);
    updates += part.updates;
    all.error_step = std::max(all.error_step, part.error_step);
    if (known.slopes) all.slope = std::max(all.slope, part.slope);
    all.object_error = std::max(all.object_error, part.object_error);
  }
  all.updates = std::uint16_t(std::min(updates, volume.set().updates(b)));
  if (all.object_error > 0 && !std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); })) {
    const double h = std::exp2(scale_of_key(volume.set().bricks()[b].key)), reach = diamond_width(volume.description().grid) / 2;
    const double farthest = reach * (known.far ? std::max(h, double(kMaxFarDeviation)) : h);
    all.object_error = std::max(all.object_error, float(farthest) * 1.1F);  // distances are rounded up
  }
  return all;
}

}  // namespace

RelevantUpdates united(const IntervalVolume& volume, std::vector<std::shared_ptr<const RelevantUpdates>> each, ShownRanges shown) {
  const RelevantUpdates::Known known{std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_slopes(); }),
                                     std::any_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); }),
                                     std::any_of(each.begin(), each.end(), [](const auto& one) { return one->may_be_far(); })};
  const Union all{volume, std::move(each), known};
  std::vector<RelevantUpdates::Bound> bounds;
  for (BrickIndex b{0}; b < volume.set().bricks().size(); ++b) bounds.push_back(all.bound(b));
  return {volume.description().grid, {volume.steps(), volume.error_steps()}, std::move(shown), std::move(bounds), known, all};
}

}  // namespace intervale
