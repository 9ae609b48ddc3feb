#include "common/ivm/relevant_updates.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// Codes an octave, the code of a ratio of 1, and the code without a bound. Both near and far ratios go from 2^-12 to
// 2^20.
constexpr int kNearSteps = 6, kNearOne = 72, kNoBound = 191;
constexpr int kFarSteps = 2, kFarOne = 216, kFirstFar = 192, kNoBoundFar = 255;

constexpr int kDistanceSteps = 8;  // an octave

constexpr double kSlopeStep = 1.5;  // octaves
constexpr int kSlopeOfOne = 7;

// Numbers of four bits, two a byte.
std::vector<std::uint8_t> in_halves(std::span<const std::uint8_t> numbers) {
  std::vector<std::uint8_t> result((numbers.size() + 1) / 2);
  for (std::size_t i = 0; i < numbers.size(); ++i) result[i / 2] = std::uint8_t(result[i / 2] | numbers[i] << (i % 2 * 4));
  return result;
}

}  // namespace

ErrorToDistance ErrorToDistance::at_least(double ratio, double unit, bool is_far) {
  if (!(ratio > 0)) return ErrorToDistance(0);
  const auto code = [&](int steps, int one) { return std::ceil(steps * std::log2(ratio / unit) - 1e-9) + one; };
  if (is_far) return ErrorToDistance(std::uint8_t(std::clamp(code(kFarSteps, kFarOne), double(kFirstFar), double(kNoBoundFar))));
  return ErrorToDistance(std::uint8_t(std::clamp(code(kNearSteps, kNearOne), 1.0, double(kNoBound))));
}

ErrorToDistance ErrorToDistance::farther(ErrorToDistance a, ErrorToDistance b, int scale) {
  if (a.code_ > b.code_) std::swap(a, b);  // codes of far ones are greater than those of all others
  if (a.code_ == 0 || a.is_far() == b.is_far()) return b;
  constexpr int kSteps = kNearSteps / kFarSteps;
  static_assert(kNearSteps % kFarSteps == 0 && kNearOne % kSteps == 0);
  // One of them in the steps of the other: of the one with the higher bound.
  if (kMaxFarDeviation >= float(1 << scale)) {
    const int far = a.code_ == kNoBound ? kNoBoundFar : kFarOne + (a.code_ + kSteps - 1) / kSteps - kNearOne / kSteps;
    return ErrorToDistance(std::uint8_t(std::clamp<int>(far, b.code_, kNoBoundFar)));
  }
  const int near = b.code_ == kNoBoundFar ? kNoBound : kNearOne + kSteps * (b.code_ - kFarOne);
  return ErrorToDistance(std::uint8_t(std::clamp<int>(near, a.code_, kNoBound)));
}

bool ErrorToDistance::is_far() const { return code_ >= kFirstFar; }

float ErrorToDistance::ratio(float unit) const {
  if (code_ == 0) return 0;
  if (code_ == kNoBound || code_ == kNoBoundFar) return std::numeric_limits<float>::max();
  if (is_far()) return unit * std::exp2(float(int(code_) - kFarOne) / kFarSteps);
  return unit * std::exp2(float(int(code_) - kNearOne) / kNearSteps);
}

double error_to_distance_unit(const Grid& grid, double max_error) {
  const Vec3 spacing = grid.affine.spacing();
  return max_error > 0 ? std::min({spacing[0], spacing[1], spacing[2]}) / max_error : 1.0;
}

double diamond_width(const Grid& grid) {
  double longest = 0;
  for (const Vec3& diagonal : {Vec3{1, 1, 1}, Vec3{-1, 1, 1}, Vec3{1, -1, 1}, Vec3{1, 1, -1}})
    longest = std::max(longest, length(grid.affine.direction(diagonal)));
  return 2 * longest;
}

std::uint8_t distance_at_least(double distance, double width) {
  if (!(distance > 0)) return 0;
  return std::uint8_t(std::clamp(std::ceil(kDistanceSteps * std::log2(distance / width / double(kMaxFarDeviation)) - 1e-4) + 255, 1.0, 255.0));
}

float distance_of(std::uint8_t distance, double width) {
  return distance == 0 ? 0 : float(width * double(kMaxFarDeviation) * std::exp2((distance - 255.0) / kDistanceSteps));
}

unsigned slope_of(double removed) {
  // The least numbers that are nearer to the slopes from 2 on than to the one before.
  static const auto kFrom = [] {
    std::array<double, kMaxSlope - 2> from{};
    for (std::size_t i = 0; i < from.size(); ++i) from[i] = std::exp2((double(i) + 1.5 - kSlopeOfOne) * kSlopeStep);
    return from;
  }();
  if (!(removed > 0)) return 0;
  return 1 + unsigned(std::upper_bound(kFrom.begin(), kFrom.end(), removed) - kFrom.begin());
}

float removed_of(unsigned slope) { return slope == 0 ? 0 : float(std::exp2((int(slope) - kSlopeOfOne) * kSlopeStep)); }

RelevantUpdates::RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown,
                                 std::vector<std::uint64_t> slots, SurfaceErrors surface)
    : shown_(std::move(shown)),
      slots_(std::move(slots)),
      error_to_distance_(std::move(surface.to_distance)),
      supercube_step_(set.supercubes()),
      distances_(std::move(surface.distances)),
      supercube_distance_(distances_.empty() ? 0 : set.supercubes()),
      slopes_(in_halves(surface.slopes)),
      supercube_slope_(set.supercubes()),
      brick_slope_(set.bricks().size()),
      brick_updates_(set.bricks().size()),
      brick_step_(set.bricks().size()),
      brick_object_error_(set.bricks().size()),
      error_(errors.values.begin(), errors.values.end()),
      reach_(float(diamond_width(grid) / 2)) {
  const auto unit = float(error_to_distance_unit(grid, error_.empty() ? 0.0 : double(error_.back())));
  for (unsigned code = 0; code < factor_.size(); ++code) {
    factor_[code] = ErrorToDistance(std::uint8_t(code)).ratio(unit);
    distance_of_[code] = distance_of(std::uint8_t(code), diamond_width(grid));
  }
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const UpdateIndex first = set.first(b, s);
      const std::uint64_t occupancy = set.occupancy()[s], relevant = this->slots(s, occupancy);
      if (relevant == 0) return;
      brick_updates_[b] = std::uint16_t(brick_updates_[b] + std::popcount(relevant));
      // Often one of the first relevant updates has the highest step of all.
      std::uint8_t most = 0, most_of_all = 0;
      for (UpdateIndex i = first; i < first + std::popcount(occupancy); ++i) most_of_all = std::max(most_of_all, errors.steps[i]);
      for (std::uint64_t left = relevant; left != 0 && most < most_of_all; left &= left - 1) {
        most = std::max(most, errors.steps[first + count_below(occupancy, Slot(std::countr_zero(left)))]);
      }
      supercube_step_[s] = most;
      brick_step_[b] = std::max(brick_step_[b], most);
      if (has_slopes()) {
        for (const Slot slot : set_bits<Slot>(relevant))
          supercube_slope_[s] = std::max(supercube_slope_[s], std::uint8_t(slope(first + count_below(occupancy, slot))));
        brick_slope_[b] = std::max(brick_slope_[b], supercube_slope_[s]);
      }
      if (has_distances()) {
        for (const Slot slot : set_bits<Slot>(relevant))
          supercube_distance_[s] = std::max(supercube_distance_[s], distances_[first + count_below(occupancy, slot)]);
      }
      brick_object_error_[b] = std::max(brick_object_error_[b], object_error(s, scale_of_key(key), most, supercube_distance(s)));
    });
  }
}

std::size_t RelevantUpdates::memory_bytes() const {
  return slots_.size() * sizeof(std::uint64_t) + error_to_distance_.size() + supercube_step_.size() + brick_step_.size() + distances_.size() +
         supercube_distance_.size() + slopes_.size() + supercube_slope_.size() + brick_slope_.size() + brick_updates_.size() * sizeof(std::uint16_t) +
         brick_object_error_.size() * sizeof(float) + error_.size() * sizeof(float);
}

RelevantUpdates united(const IntervalVolume& volume, std::span<const std::shared_ptr<const RelevantUpdates>> each, ShownRanges shown) {
  const SupercubeSet& set = volume.set();
  std::vector<std::uint64_t> slots(set.supercubes());
  SurfaceErrors surface{std::vector<ErrorToDistance>(set.supercubes())};
  if (std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_slopes(); })) {
    surface.slopes.resize(volume.size());
    for (const auto& one : each) {
      for (UpdateIndex i{0}; i < volume.size(); ++i) surface.slopes[i] = std::max(surface.slopes[i], std::uint8_t(one->slope(i)));
    }
  }
  const double width = diamond_width(volume.description().grid);
  const bool has_distances = std::any_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); });
  if (has_distances) surface.distances.resize(volume.size());
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const std::uint64_t occupancy = set.occupancy()[s];
      for (const auto& one : each) {
        slots[s] |= one->slots(s, occupancy);
        surface.to_distance[s] = ErrorToDistance::farther(surface.to_distance[s], one->error_to_distance()[s], scale_of_key(key));
      }
      for (const auto& one : each) {
        for (const Slot slot : set_bits<Slot>(has_distances ? one->slots(s, occupancy) : 0)) {
          const UpdateIndex i = set.first(b, s) + count_below(occupancy, slot);
          const std::uint8_t distance =
              one->has_distances()
                  ? one->distance(i)
                  : distance_at_least(double(one->object_error(surface.to_distance[s], scale_of_key(key), volume.error_step(i))), width);
          surface.distances[i] = std::max(surface.distances[i], distance);
        }
      }
    });
  }
  return {volume.description().grid, set, {volume.steps(), volume.error_steps()}, std::move(shown), std::move(slots), std::move(surface)};
}

}  // namespace intervale
