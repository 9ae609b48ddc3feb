// Sigma: a compact multiresolution interval volume. Updates only, no field; immutable, shared by all that read it.
//
// Weiss and De Floriani 2008, section 6. For each relevant diamond it holds an update: the value at the centre, from
// which and from the values at the diamond's vertices the side of the centre and the cuts on the subdivision edges
// follow, and the saturated error, which tells whether a level of detail needs the update. The paper stores 12 bytes
// for each update and one for each cut; here supercubes (supercube.h) replace the coordinates and the pointer, and the
// value the cuts.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/value_keys.h"
#include "common/patch/description.h"
#include "common/patch/range.h"
#include "common/util/result.h"

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
  [[nodiscard]] std::uint8_t code() const { return code_; }
  [[nodiscard]] bool is_far() const;
  [[nodiscard]] float ratio(float unit) const;  // the largest float where no bound is known

 private:
  std::uint8_t code_ = 0;
};

// The largest distance that is recorded, in widths of a diamond with h = 1.
inline constexpr float kMaxFarDeviation = 64;

inline constexpr int kMaxErrorSteps = 256;  // distinct errors at most; each update's is rounded up to one of them

class IntervalVolume {
 public:
  // The arrays that an interval volume is made of.
  struct Parts {
    Description description;  // updates and content_hash are computed
    SupercubeSet set;
    ValueKeys keys;                                  // by number of the update: of the value at the diamond's centre
    std::vector<std::uint8_t> steps;                 // by number of the update: which of error_steps its error is
    std::vector<float> error_steps;                  // ascending, at most kMaxErrorSteps
    std::vector<ErrorToDistance> error_to_distance;  // by supercube
  };
  // Fails where sizes or ranges of the parts do not match; validate() checks the meaning.
  static Result<IntervalVolume> assemble(Parts parts);

  [[nodiscard]] const Description& description() const { return description_; }
  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const SupercubeSet& set() const { return set_; }
  [[nodiscard]] std::uint32_t size() const { return set_.size(); }

  // Saturated error in the field's units, rounded up: no smaller than that of any child. Monotone in error_step.
  [[nodiscard]] float error(UpdateIndex i) const { return error_steps_[steps_[i]]; }
  [[nodiscard]] unsigned error_step(UpdateIndex i) const { return steps_[i]; }
  [[nodiscard]] unsigned brick_error_step(BrickIndex brick) const { return brick_step_[brick]; }  // the highest of a brick's updates
  [[nodiscard]] std::span<const float> error_steps() const { return error_steps_; }
  [[nodiscard]] std::span<const std::uint8_t> steps() const { return steps_; }
  [[nodiscard]] ValueKey key(UpdateIndex i) const { return keys_[i]; }  // of the value at the diamond's centre
  [[nodiscard]] const ValueKeys& keys() const { return keys_; }
  [[nodiscard]] std::span<const std::uint8_t> supercube_error_steps() const { return supercube_step_; }  // of each the highest of its updates
  // How far the surfaces can still move, in world units, while an update's diamond is refined completely. An estimate:
  // 99 % of the surface should move no further, and nothing more than twice as far (FORMAT.md, "From errors to
  // distances"). It depends on the update's supercube and scale, and grows with the error step. Not saturated.
  [[nodiscard]] float object_error(SupercubeIndex supercube, int scale, unsigned step) const {
    const ErrorToDistance to_distance = error_to_distance_[supercube];
    const float distance = error_steps_[step] * factor_[to_distance.code()];
    return std::min(distance, reach_ * (to_distance.is_far() ? kMaxFarDeviation : float(1 << scale)));
  }
  [[nodiscard]] float brick_object_error(BrickIndex brick) const { return brick_object_error_[brick]; }  // the largest of a brick's updates
  [[nodiscard]] std::span<const ErrorToDistance> error_to_distance() const { return error_to_distance_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  explicit IntervalVolume(Parts parts);
  Description description_;
  Domain domain_;
  SupercubeSet set_;
  ValueKeys keys_;
  std::vector<std::uint8_t> steps_;
  std::vector<std::uint8_t> brick_step_;  // by brick: the highest of its updates' error steps
  std::vector<float> error_steps_;
  std::vector<ErrorToDistance> error_to_distance_;  // by supercube
  std::vector<std::uint8_t> supercube_step_;        // by supercube: the highest of its updates' error steps
  std::vector<float> brick_object_error_;           // by brick: the largest of its updates
  std::array<float, 256> factor_;                   // by code of an ErrorToDistance
  float reach_ = 0;                                 // the largest object error for h = 1: half a diamond's width
};

// The unit of the ratios of ErrorToDistance.
[[nodiscard]] double error_to_distance_unit(const Grid& grid, double max_error);
// The width of a diamond with h = 1, the diagonal of its two cells a side, in world units.
[[nodiscard]] double diamond_width(const Grid& grid);

}  // namespace intervale
