// Sigma: a compact multiresolution interval volume. Updates only, no field; immutable, shared by all that read it.
//
// Weiss and De Floriani 2008, section 6. For each relevant diamond it holds an update: the side of the centre, the cuts
// on the subdivision edges, and the saturated error, which tells whether a level of detail needs the update. The paper
// stores 12 bytes for each update and one for each cut; here supercubes (supercube.h) replace the coordinates and the
// pointer. Sides and cuts are stored as residuals of the prediction from the diamond itself (prediction.h): they take
// the same memory, and files and messages need no other form.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/codec/prediction.h"
#include "common/codec/update.h"
#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
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

inline constexpr int kMaxErrorSteps = 512;  // distinct errors at most; each update's is rounded up to one of them

// One update in 16 bits: the residual of the centre's side, how many coefficients it has, and the step of its error.
class UpdateCode {
 public:
  UpdateCode() = default;
  explicit UpdateCode(std::uint16_t bits) : bits_(bits) {}
  // Of `all` coefficients (at most 20), `first` are the first of their surface: none, one (then at most 10 in all) or
  // two.
  UpdateCode(unsigned side_residual, unsigned all, unsigned first, unsigned error_step)
      : bits_(std::uint16_t(side_residual | (first == 2 ? all + 9 : all) << 2 | error_step << 7)) {}
  [[nodiscard]] std::uint16_t bits() const { return bits_; }
  [[nodiscard]] unsigned side_residual() const { return bits_ & 3u; }
  [[nodiscard]] unsigned coefficients() const { return counts() > 10 ? counts() - 9 : counts(); }
  [[nodiscard]] unsigned first_cuts() const { return counts() == 0 ? 0 : counts() > 10 ? 2 : 1; }
  [[nodiscard]] unsigned error_step() const { return bits_ >> 7; }
  [[nodiscard]] std::uint8_t shape() const { return bits_ & 127u; }  // all but the error

 private:
  [[nodiscard]] unsigned counts() const { return bits_ >> 2 & 31u; }
  std::uint16_t bits_ = 0;
};

class IntervalVolume {
 public:
  // The arrays that an interval volume is made of.
  struct Parts {
    Description description;  // updates, coefficients and content_hash are computed
    SupercubeSet set;
    std::vector<UpdateCode> codes;                   // by number of the update
    std::vector<std::uint8_t> residuals;             // of all updates, concatenated
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
  [[nodiscard]] float error(UpdateIndex i) const { return error_steps_[codes_[i].error_step()]; }
  [[nodiscard]] unsigned error_step(UpdateIndex i) const { return codes_[i].error_step(); }
  [[nodiscard]] unsigned brick_error_step(BrickIndex brick) const { return brick_step_[brick]; }  // the highest of a brick's updates
  [[nodiscard]] std::span<const float> error_steps() const { return error_steps_; }
  [[nodiscard]] std::span<const UpdateCode> codes() const { return codes_; }
  [[nodiscard]] std::span<const std::uint8_t> residuals() const { return residuals_; }
  // Error steps in a byte: of each supercube the highest of its updates, halved.
  [[nodiscard]] std::span<const std::uint8_t> supercube_half_steps() const { return supercube_half_step_; }
  [[nodiscard]] static std::uint8_t half_of_step(unsigned step) { return std::uint8_t(step / 2); }
  // No lower than the argument of half_of_step(), and higher by one at most.
  [[nodiscard]] unsigned step_of_half(std::uint8_t half) const { return std::min(2u * half + 1, unsigned(error_steps_.size()) - 1); }
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
  [[nodiscard]] UpdateView update(const Place& p) const;  // O(1): at most 55 codes are summed
  // The same, in steps, for loops over a supercube that keep the sum: its first residual, and an update by the number
  // of its first residual.
  [[nodiscard]] std::uint32_t first_residual(BrickIndex brick, SupercubeIndex supercube) const {
    return brick_first_[brick] + first_in_brick_[supercube];
  }
  [[nodiscard]] UpdateView update(UpdateIndex i, std::uint32_t residual) const {
    const UpdateCode code = codes_[i];
    return {code.side_residual(), code.first_cuts(), std::span(residuals_).subspan(residual, code.coefficients())};
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  explicit IntervalVolume(Parts parts);
  Description description_;
  Domain domain_;
  SupercubeSet set_;
  std::vector<UpdateCode> codes_;
  std::vector<std::uint32_t> brick_first_;     // by brick: number of its first residual
  std::vector<std::uint16_t> first_in_brick_;  // by supercube: its first residual, counted from its brick's; 64 supercubes have at most 57344
  std::vector<std::uint16_t> brick_step_;      // by brick: the highest of its updates' error steps
  std::vector<std::uint8_t> residuals_;
  std::vector<float> error_steps_;
  std::vector<ErrorToDistance> error_to_distance_;  // by supercube
  std::vector<std::uint8_t> supercube_half_step_;   // by supercube: half_of_step() of the highest of its updates
  std::vector<float> brick_object_error_;           // by brick: the largest of its updates
  std::array<float, 256> factor_;                   // by code of an ErrorToDistance
  float reach_ = 0;                                 // the largest object error for h = 1: half a diamond's width
};

// The unit of the ratios of ErrorToDistance.
[[nodiscard]] double error_to_distance_unit(const Grid& grid, double max_error);
// The width of a diamond with h = 1, the diagonal of its two cells a side, in world units.
[[nodiscard]] double diamond_width(const Grid& grid);

}  // namespace intervale
