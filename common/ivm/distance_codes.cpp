#include "common/ivm/distance_codes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace intervale {
namespace {

// Codes an octave, the code of a ratio of 1, and the code without a bound. Both near and far ratios go from 2^-12 to
// 2^20.
constexpr int kNearSteps = 6, kNearOne = 72, kNoBound = 191;
constexpr int kFarSteps = 2, kFarOne = 216, kNoBoundFar = 255;

constexpr int kDistanceSteps = 8;  // an octave

constexpr double kSlopeStep = 1.5;  // octaves
constexpr int kSlopeOfOne = 7;

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

}  // namespace intervale
