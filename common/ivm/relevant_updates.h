// Which updates of an interval volume are relevant to a range, and how far the surfaces of that range can move.
//
// Weiss and De Floriani 2008, section 6. A data set of one range holds only what its range needs: all of it is relevant.
// Of a data set that was refined uniformly, or that has every range, any range within needs a part. Several ranges need
// what each of them needs. Immutable, shared by all sessions that look at those ranges.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/patch/description.h"

namespace intervale {

class IntervalVolume;

// Converts errors to distances: how far the surfaces can still move, in world units, for each unit of field error. One
// byte a supercube, a logarithmic code rounded up; 0: nothing moves. Most distances are also bounded by the width of
// the diamond; their codes are sixths of an octave, and the last one has no other bound. For surface points far from
// every patch of the coarse mesh (small separate pieces), the bound is kMaxFarDeviation instead of the diamond's width;
// those codes are halves of an octave, and the last one has no other bound.
class ErrorToDistance {
 public:
  ErrorToDistance() = default;
  explicit ErrorToDistance(std::uint8_t code) : code_(code) {}
  // The least code for `ratio`, at least 0 or infinite, in units of `unit`.
  static ErrorToDistance at_least(double ratio, double unit, bool is_far = false);
  // The least code by which errors of diamonds of this scale move surfaces as far as by each of both, with their bounds.
  static ErrorToDistance farther(ErrorToDistance a, ErrorToDistance b, int scale);
  [[nodiscard]] std::uint8_t code() const { return code_; }
  [[nodiscard]] bool is_far() const;
  [[nodiscard]] float ratio(float unit) const;  // the largest float where no bound is known

 private:
  std::uint8_t code_ = 0;
};

// The largest distance that is recorded, in widths of a diamond with h = 1.
inline constexpr float kMaxFarDeviation = 64;

// The unit of the ratios of ErrorToDistance: the least spacing for the largest error.
[[nodiscard]] double error_to_distance_unit(const Grid& grid, double max_error);
// The width of a diamond with h = 1, the longest diagonal of its two cells a side, in world units.
[[nodiscard]] double diamond_width(const Grid& grid);

// Slopes: how much squared deviation an update takes away from the surface, together with the descendants that it makes
// way for, for each of these updates (common/ranges/update_slopes.h). In squares of the least spacing of samples, on a
// scale of logarithms: 1 to 14 are 2^(1.5 (slope - 7)), the nearest of them; 0 is nothing, and kMaxSlope is not measured
// and comes before all others.
inline constexpr unsigned kMaxSlope = 15;
[[nodiscard]] unsigned slope_of(double removed);
[[nodiscard]] float removed_of(unsigned slope);

// Distances: how far, in world units, the surfaces can still move while an update's diamond is refined completely, for
// each update. On a scale of logarithms, rounded up to one of eight steps an octave; 0: nothing moves. width: of a diamond
// with h = 1.
[[nodiscard]] std::uint8_t distance_at_least(double distance, double width);  // at most kMaxFarDeviation widths
[[nodiscard]] float distance_of(std::uint8_t distance, double width);

// What is known of how far surfaces move.
struct SurfaceErrors {
  std::vector<ErrorToDistance> to_distance;  // by supercube
  std::vector<std::uint8_t> slopes = {};     // by number of the update, at most kMaxSlope; empty: not known
  std::vector<std::uint8_t> distances = {};  // by number of the update; empty: not known, to_distance says what is
};

// The errors of an interval volume, by number of the update.
struct UpdateErrors {
  std::span<const std::uint8_t> steps;  // which of `values` its error is
  std::span<const float> values;        // ascending, at most 256
};

class RelevantUpdates {
 public:
  // Of all updates of the set, if slots is empty. slots: by supercube, closed under parents. shown: what they are relevant
  // to, one range at least.
  RelevantUpdates(const Grid& grid, const SupercubeSet& set, const UpdateErrors& errors, ShownRanges shown, std::vector<std::uint64_t> slots,
                  SurfaceErrors surface);

  [[nodiscard]] const ShownRanges& shown() const { return shown_; }
  // Of a supercube with this occupancy.
  [[nodiscard]] std::uint64_t slots(SupercubeIndex supercube, std::uint64_t occupancy) const {
    return slots_.empty() ? occupancy : slots_[supercube];
  }

  // The number of a brick's relevant updates.
  [[nodiscard]] unsigned brick_updates(BrickIndex brick) const { return brick_updates_[brick]; }
  // The highest error step of a brick's or a supercube's relevant updates; 0 if there are none.
  [[nodiscard]] unsigned brick_error_step(BrickIndex brick) const { return brick_step_[brick]; }
  [[nodiscard]] std::span<const std::uint8_t> supercube_error_steps() const { return supercube_step_; }
  // How far the surfaces can still move, in world units, while an update's diamond is refined completely. An estimate:
  // 99 % of the surface should move no further, and nothing more than twice as far (FORMAT.md, "From errors to
  // distances"). Where distances are known, that is what they say, and it grows with the distance. Otherwise it depends on
  // the update's supercube and scale, and grows with the error step. Not saturated.
  [[nodiscard]] float object_error(SupercubeIndex supercube, int scale, unsigned step, std::uint8_t distance) const {
    return has_distances() ? distance_of_[distance] : object_error(error_to_distance_[supercube], scale, step);
  }
  [[nodiscard]] float object_error(ErrorToDistance to_distance, int scale, unsigned step) const {
    return std::min(error_[step] * factor_[to_distance.code()], reach_ * (to_distance.is_far() ? kMaxFarDeviation : float(1 << scale)));
  }
  [[nodiscard]] float brick_object_error(BrickIndex brick) const { return brick_object_error_[brick]; }  // the largest of its relevant updates
  [[nodiscard]] std::span<const ErrorToDistance> error_to_distance() const { return error_to_distance_; }
  // The distance of an update, and the largest of a supercube's relevant updates; 0 where they are not known.
  [[nodiscard]] bool has_distances() const { return !distances_.empty(); }
  [[nodiscard]] std::uint8_t distance(UpdateIndex i) const { return distances_.empty() ? std::uint8_t(0) : distances_[i]; }
  [[nodiscard]] std::uint8_t supercube_distance(SupercubeIndex s) const { return distances_.empty() ? std::uint8_t(0) : supercube_distance_[s]; }
  // The slope of an update, and the highest of a brick's or a supercube's relevant updates; 0 where they are not known.
  [[nodiscard]] bool has_slopes() const { return !slopes_.empty(); }
  [[nodiscard]] unsigned slope(UpdateIndex i) const { return slopes_.empty() ? 0 : unsigned(slopes_[i / 2] >> (i % 2 * 4)) & 15U; }
  [[nodiscard]] unsigned brick_slope(BrickIndex brick) const { return brick_slope_[brick]; }
  [[nodiscard]] std::span<const std::uint8_t> supercube_slopes() const { return supercube_slope_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  ShownRanges shown_;
  std::vector<std::uint64_t> slots_;                // by supercube; empty: all
  std::vector<ErrorToDistance> error_to_distance_;  // by supercube
  std::vector<std::uint8_t> supercube_step_;        // by supercube
  std::vector<std::uint8_t> distances_;             // by number of the update; empty: not known
  std::vector<std::uint8_t> supercube_distance_;    // by supercube
  std::vector<std::uint8_t> slopes_;                // by two updates, the first in the lower half; empty: not known
  std::vector<std::uint8_t> supercube_slope_;       // by supercube
  std::vector<std::uint8_t> brick_slope_;           // by brick
  std::vector<std::uint16_t> brick_updates_;        // by brick
  std::vector<std::uint8_t> brick_step_;            // by brick
  std::vector<float> brick_object_error_;           // by brick
  std::vector<float> error_;                        // by error step
  std::array<float, 256> factor_;                   // by code of an ErrorToDistance
  std::array<float, 256> distance_of_;              // by distance of an update
  float reach_ = 0;                                 // the largest object error for h = 1: half a diamond's width
};

// What several ranges, or the parts of one, need together: an update is relevant if it is to any of them, and the surfaces
// around it can move as far as those that can move farthest. Where some have distances, what is relevant to the others gets
// them from errors: also inside, where values may show. each: of this volume, one at least. shown: the ranges. O(updates).
[[nodiscard]] RelevantUpdates united(const IntervalVolume& volume, std::span<const std::shared_ptr<const RelevantUpdates>> each, ShownRanges shown);

}  // namespace intervale
