// Sigma: a compact multiresolution interval volume. Updates only, no field; immutable, shared by all that read it.
//
// Weiss and De Floriani 2008, section 6. For each relevant diamond it holds what splitting it takes: the side of its centre and the cuts on its
// subdivision edges, and the saturated error that says when. The paper spends 12 bytes on each and one on each cut; here supercubes (supercube.h)
// stand for the coordinates and the pointer. Sides and cuts are kept as residuals from what the diamond itself predicts (prediction.h): no larger
// in memory, and ready for file and wire.
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

// How far the surfaces can still move, in world units, for each unit of field error: one byte a supercube, rounded up. 0: nothing moves. Most are
// bounded by how wide a diamond is as well, and go in sixths of an octave; the last of those has no other bound. Where a speck has no patch and the
// next one is far, diamonds' widths do not count, but kFurthest does: those go in halves of an octave, and the last one has no other bound.
class Yield {
 public:
  Yield() = default;
  explicit Yield(std::uint8_t step) : step_(step) {}
  // The least step for `ratio`, at least 0 or infinite, in units of `unit`.
  static Yield at_least(double ratio, double unit, bool is_far = false);
  [[nodiscard]] std::uint8_t step() const { return step_; }
  [[nodiscard]] bool is_far() const;
  [[nodiscard]] float ratio(float unit) const;  // the largest there is where no bound is known

 private:
  std::uint8_t step_ = 0;
};

inline constexpr float kFurthest = 64;  // of what a diamond with h = 1 measures across: the most that is told of how far anything moves

inline constexpr int kErrorLevels = 512;  // distinct errors at most; each update's is rounded up to one of them

// One update in 16 bits: the residual of the centre's side, how many coefficients it has, and the level of its error.
class UpdateCode {
 public:
  UpdateCode() = default;
  explicit UpdateCode(std::uint16_t bits) : bits_(bits) {}
  // Of `all` coefficients (at most 20), `first` are the first of their surface: none, one (then at most 10 in all) or two.
  UpdateCode(unsigned side_residual, unsigned all, unsigned first, unsigned error_level)
      : bits_(std::uint16_t(side_residual | (first == 2 ? all + 9 : all) << 2 | error_level << 7)) {}
  [[nodiscard]] std::uint16_t bits() const { return bits_; }
  [[nodiscard]] unsigned side_residual() const { return bits_ & 3u; }
  [[nodiscard]] unsigned coefficients() const { return counts() > 10 ? counts() - 9 : counts(); }
  [[nodiscard]] unsigned first_cuts() const { return counts() == 0 ? 0 : counts() > 10 ? 2 : 1; }
  [[nodiscard]] unsigned error_level() const { return bits_ >> 7; }
  [[nodiscard]] std::uint8_t shape() const { return bits_ & 127u; }  // all but the error

 private:
  [[nodiscard]] unsigned counts() const { return bits_ >> 2 & 31u; }
  std::uint16_t bits_ = 0;
};

class IntervalVolume {
 public:
  // What it is made of. Sizes that do not fit together are refused by assemble().
  struct Parts {
    Description description;  // updates, coefficients and content_hash are computed
    SupercubeSet set;
    std::vector<UpdateCode> codes;        // by number of the update
    std::vector<std::uint8_t> residuals;  // all updates' one after the other
    std::vector<float> error_levels;      // ascending, at most kErrorLevels
    std::vector<Yield> yields;            // by supercube
  };
  // Fails where the parts do not fit together; validate() checks the meaning.
  static Result<IntervalVolume> assemble(Parts parts);

  [[nodiscard]] const Description& description() const { return description_; }
  [[nodiscard]] const Domain& domain() const { return domain_; }
  [[nodiscard]] const SupercubeSet& set() const { return set_; }
  [[nodiscard]] UpdateIndex size() const { return set_.size(); }

  // Saturated error in the field's units, rounded up: no smaller than that of any child. Monotone in error_level.
  [[nodiscard]] float error(UpdateIndex i) const { return error_levels_[codes_[i].error_level()]; }
  [[nodiscard]] unsigned error_level(UpdateIndex i) const { return codes_[i].error_level(); }
  [[nodiscard]] unsigned brick_error_level(std::uint32_t brick) const { return brick_level_[brick]; }  // the highest of a brick's updates
  [[nodiscard]] std::span<const float> error_levels() const { return error_levels_; }
  [[nodiscard]] std::span<const UpdateCode> codes() const { return codes_; }
  [[nodiscard]] std::span<const std::uint8_t> residuals() const { return residuals_; }
  // Levels of error in a byte: of each supercube the highest of its updates.
  [[nodiscard]] std::span<const std::uint8_t> supercube_half_levels() const { return supercube_level_; }
  [[nodiscard]] static std::uint8_t half_of_level(unsigned level) { return std::uint8_t(level / 2); }
  // No lower than the level that half_of_level() took, and higher by one at most.
  [[nodiscard]] unsigned level_of_half(std::uint8_t half) const { return std::min(2u * half + 1, unsigned(error_levels_.size()) - 1); }
  // Half of how far the surfaces can still move where an update's diamond is refined to the end, in world units: hardly anything moves further than
  // this, and nothing twice as far, as far as is known. By its supercube, that one's scale, and the update's level of error, with which it grows. Not
  // saturated.
  [[nodiscard]] float object_error(std::uint32_t supercube, int scale, unsigned level) const {
    const Yield yield = yields_[supercube];
    const float error = error_levels_[level] * factor_[yield.step()];
    return std::min(error, reach_ * (yield.is_far() ? kFurthest : float(1 << scale)));
  }
  [[nodiscard]] float brick_object_error(std::uint32_t brick) const { return brick_object_error_[brick]; }  // the largest of a brick's updates
  [[nodiscard]] std::span<const Yield> yields() const { return yields_; }
  [[nodiscard]] UpdateView update(const Place& p) const;  // O(1): at most 55 codes are summed
  // The same, for those who go through a supercube and sum as they go: its first residual, and an update by its own first one.
  [[nodiscard]] std::uint32_t first_residual(std::uint32_t brick, std::uint32_t supercube) const {
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
  std::vector<std::uint32_t> brick_first_;     // residual, of each brick
  std::vector<std::uint16_t> first_in_brick_;  // residual, of each supercube: 64 supercubes have no more than 57344
  std::vector<std::uint16_t> brick_level_;     // the highest level of error, of each brick
  std::vector<std::uint8_t> residuals_;
  std::vector<float> error_levels_;
  std::vector<Yield> yields_;                  // by supercube
  std::vector<std::uint8_t> supercube_level_;  // by supercube: half_of_level() of the highest of its updates
  std::vector<float> brick_object_error_;      // the largest of its updates
  std::array<float, 256> factor_;              // of each step of a Yield
  float reach_ = 0;                            // the largest object error for h = 1: half of what a diamond measures across
};

// What Yields are in units of.
[[nodiscard]] double yield_unit(const Grid& grid, double max_error);
// What a diamond with h = 1 measures across, in world units.
[[nodiscard]] double diamond_width(const Grid& grid);

}  // namespace intervale
