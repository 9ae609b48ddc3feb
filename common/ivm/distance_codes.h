// How far surfaces can move, in one byte: for a supercube and for an update; and what an update removes, in four bits.
#pragma once

#include <cstdint>

#include "common/diamond/grid.h"

namespace intervale {

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
  [[nodiscard]] bool is_far() const { return code_ >= kFirstFar; }
  [[nodiscard]] float ratio(float unit) const;  // the largest float where no bound is known

 private:
  static constexpr int kFirstFar = 192;
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
inline constexpr int kTopScale = 4;  // diamonds of coarser scales have kMaxSlope
[[nodiscard]] unsigned slope_of(double removed);
[[nodiscard]] float removed_of(unsigned slope);

// Distances: how far, in world units, the surfaces can still move while an update's diamond is refined completely, for
// each update. On a scale of logarithms, rounded up to one of eight steps an octave; 0: nothing moves. width: of a diamond
// with h = 1.
[[nodiscard]] std::uint8_t distance_at_least(double distance, double width);  // at most kMaxFarDeviation widths
[[nodiscard]] float distance_of(std::uint8_t distance, double width);

}  // namespace intervale
