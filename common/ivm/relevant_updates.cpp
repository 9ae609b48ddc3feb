#include "common/ivm/relevant_updates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"

namespace intervale {

RelevantUpdates::Codes::Codes(const Grid& grid, const UpdateErrors& errors)
    : error(errors.values.begin(), errors.values.end()), reach(float(diamond_width(grid) / 2)) {
  const auto unit = float(error_to_distance_unit(grid, error.empty() ? 0.0 : double(error.back())));
  for (unsigned code = 0; code < factor.size(); ++code) {
    factor[code] = ErrorToDistance(std::uint8_t(code)).ratio(unit);
    distance[code] = distance_of(std::uint8_t(code), diamond_width(grid));
  }
}

RelevantUpdates::RelevantUpdates(const Grid& grid, const UpdateErrors& errors, ShownRanges shown, std::vector<Bound> bounds, Known known, Find find)
    : shown_(std::move(shown)),
      known_(known),
      codes_(std::make_shared<const Codes>(grid, errors)),
      bounds_(std::move(bounds)),
      found_(std::make_shared<Found>(bounds_.size(), std::move(find))) {
  bound_runs();
}

void RelevantUpdates::bound_runs() {
  runs_.assign((bounds_.size() + kRun - 1) / kRun, {});
  for (std::size_t b = 0; b < bounds_.size(); ++b) runs_[b / kRun].add(bounds_[b]);
}

RelevantUpdates::RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown,
                                 const std::vector<std::uint64_t>& slots, const SurfaceErrors& surface, const ParallelFor& parallel)
    : RelevantUpdates(
          grid, set, errors, std::move(shown),
          {!surface.slopes.empty(), !surface.distances.empty(),
           std::any_of(surface.to_distance.begin(), surface.to_distance.end(), [](ErrorToDistance code) { return code.is_far(); })},
          [&](BrickIndex b) {
            std::vector<BrickPart::Supercube> needs;
            BrickPart::Surface of_updates;
            set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
              const std::uint64_t occupancy = set.occupancy()[s];
              needs.push_back({slots.empty() ? occupancy : slots[s], surface.to_distance[s]});
              for (const Slot slot : set_bits<Slot>(needs.back().slots)) {
                const UpdateIndex i = set.first(b, s) + count_below(occupancy, slot);
                if (!surface.slopes.empty()) of_updates.slopes.push_back(surface.slopes[i]);
                if (!surface.distances.empty()) of_updates.distances.push_back(surface.distances[i]);
              }
            });
            return BrickPart(set, b, errors.steps, needs, std::move(of_updates));
          },
          parallel) {}

RelevantUpdates::RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown, Known known,
                                 const FindAny& find, const ParallelFor& parallel)
    : RelevantUpdates(grid, errors, std::move(shown), std::vector<Bound>(set.bricks().size()), known, {}) {
  parallel(bounds_.size(), [&](std::size_t i) {
    const BrickIndex b{std::uint32_t(i)};
    auto found = find(b);
    if (!found) return;
    const BrickPart& brick = found_->bricks.keep(b, std::move(*found)).value;
    found_->bytes += brick.memory_bytes();
    bounds_[b] = bound_of(set, b, brick);
  });
  bound_runs();
}

RelevantUpdates::Bound RelevantUpdates::bound_of(const SupercubeSet& set, BrickIndex b, const BrickPart& brick) const {
  Bound bound{.updates = std::uint16_t(brick.updates())};
  const BrickNeeds needs(brick);
  const int scale = scale_of_key(set.bricks()[b].key);
  std::size_t n = 0;
  set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
    const std::size_t number = n++;
    if (brick.slots(number, set.occupancy()[s]) == 0) return;
    const BrickNeeds::Highest highest = needs.highest(number);
    bound.error_step = std::max(bound.error_step, highest.error_step);
    bound.slope = std::max(bound.slope, highest.slope);
    bound.object_error = std::max(bound.object_error, object_error(needs.to_distance(number), scale, highest.error_step, highest.distance));
  });
  return bound;
}

const BrickPart& RelevantUpdates::Found::find_now(BrickIndex brick) {
  const auto [kept, is_new] = bricks.keep(brick, find(brick));
  if (is_new) {
    bytes += kept.memory_bytes();
    if (on_growth) on_growth();
  }
  return kept;
}

RelevantUpdates::RelevantUpdates(const SupercubeSet& set, Parts parts, ShownRanges shown)
    : shown_(std::move(shown)), known_(parts.front()->known_), codes_(parts.front()->codes_), parts_(std::move(parts)), set_(&set) {
  for (const auto& part : parts_) known_.far = known_.far || part->known_.far;
}

std::optional<RelevantUpdates::SharedParts> RelevantUpdates::shared_with(const RelevantUpdates& other) const {
  static_assert(BrickNeeds::kMostParts <= 8 * sizeof(PartMask));
  if (!has_parts() || !other.has_parts() || has_slopes() != other.has_slopes() || has_distances() != other.has_distances()) return {};
  SharedParts shared;
  shared.fill(-1);
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto there = std::find(other.parts_.begin(), other.parts_.end(), parts_[i]);
    if (there != other.parts_.end()) shared[i] = std::int8_t(there - other.parts_.begin());
  }
  return shared;
}

BrickNeeds RelevantUpdates::brick(BrickIndex brick, PartMask parts) const {
  BrickNeeds needs;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if ((parts >> i & 1) != 0 && parts_[i]->bounds_[brick].updates != 0) needs.add(parts_[i]->own_brick(brick));
  }
  return needs;
}

RelevantUpdates::Bound RelevantUpdates::bound(BrickIndex brick, PartMask parts) const {
  Bound all;
  unsigned updates = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if ((parts >> i & 1) == 0) continue;
    const Bound& one = parts_[i]->bounds_[brick];
    updates += one.updates;
    all.error_step = std::max(all.error_step, one.error_step);
    all.slope = std::max(all.slope, one.slope);
    all.object_error = std::max(all.object_error, one.object_error);
  }
  all.updates = std::uint16_t(std::min(updates, set_->updates(brick)));
  return all;
}

bool RelevantUpdates::is_found(BrickIndex brick) const {
  if (parts_.empty()) return bounds_[brick].updates == 0 || found_->bricks.find(brick) != nullptr;
  return std::all_of(parts_.begin(), parts_.end(), [&](const auto& part) { return part->is_found(brick); });
}

std::size_t RelevantUpdates::memory_bytes() const {
  if (has_parts()) return sizeof *this + parts_.size() * sizeof parts_[0];
  return sizeof *this + bounds_.size() * (sizeof(Bound) + sizeof(void*)) + runs_.size() * sizeof(RunBound) + sizeof *codes_ +
         codes_->error.size() * sizeof(float) + found_->bytes;
}

namespace {

// What is united, and where, if not the same is known of each.
struct Union {
  const IntervalVolume& volume;
  std::vector<std::shared_ptr<const RelevantUpdates>> each;
  RelevantUpdates::Known known;

  [[nodiscard]] BrickPart operator()(BrickIndex b) const;
  [[nodiscard]] RelevantUpdates::Bound bound(BrickIndex b) const;
};

BrickPart Union::operator()(BrickIndex b) const {
  struct Part {
    const RelevantUpdates& of;
    BrickNeeds needs;
  };
  const SupercubeSet& set = volume.set();
  std::vector<Part> parts;
  for (const auto& one : each) {
    if (one->bound(b).updates != 0) parts.push_back({*one, one->brick(b)});
  }
  const double width = diamond_width(volume.description().grid);
  const int scale = scale_of_key(set.bricks()[b].key);
  std::vector<BrickPart::Supercube> needs;
  BrickPart::Surface surface;
  std::array<std::uint8_t, kSlots> slopes{}, distances{};  // those of relevant slots are set
  std::size_t n = 0;
  set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
    const std::uint64_t occupancy = set.occupancy()[s];
    BrickPart::Supercube all;
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
    const RelevantUpdates::Bound part = one->bound(b);
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

RelevantUpdates united(const IntervalVolume& volume, RelevantUpdates::Parts each, ShownRanges shown) {
  const RelevantUpdates::Known known{std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_slopes(); }),
                                     std::any_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); }),
                                     std::any_of(each.begin(), each.end(), [](const auto& one) { return one->may_be_far(); })};
  RelevantUpdates::Parts parts;
  bool are_alike = true;
  for (const auto& one : each) {
    are_alike = are_alike && one->has_slopes() == known.slopes && one->has_distances() == known.distances;
    for (const auto& part : one->has_parts() ? one->parts_ : RelevantUpdates::Parts{one}) {
      if (std::find(parts.begin(), parts.end(), part) == parts.end()) parts.push_back(part);
    }
  }
  if (are_alike && parts.size() <= BrickNeeds::kMostParts) return {volume.set(), std::move(parts), std::move(shown)};
  const Union all{volume, std::move(each), known};
  std::vector<RelevantUpdates::Bound> bounds;
  bounds.reserve(volume.set().bricks().size());
  for (BrickIndex b{0}; b < volume.set().bricks().size(); ++b) bounds.push_back(all.bound(b));
  return {volume.description().grid, {volume.steps(), volume.error_steps()}, std::move(shown), std::move(bounds), known, all};
}

}  // namespace intervale
