// Which updates a level of detail wants for their own sake, and which of them matter most. Pure: a function of the data set and what is asked for.
//
// Without a camera an update matters by its field error; with one, by the pixels that the surfaces it moves are off on the screen. Pixels are figured
// once for a supercube, or for a brick that is far away, for the nearest of it that is seen.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <optional>

#include "common/ivm/interval_volume.h"
#include "common/view/lod.h"
#include "common/view/screen_error.h"

namespace intervale {

class Ranking {
 public:
  // volume must outlive it; lod: one that check_lod lets pass.
  Ranking(const IntervalVolume& volume, const Lod& lod);

  // 0: not wanted for its own sake. Else what matters more has a higher rank.
  using Rank = std::uint16_t;

  // Of one supercube's updates.
  class Supercube {
   public:
    // What an update matters by its level of error, with which it grows: 0 if it is not wanted for its own sake. Of diamonds that meet the region of
    // interest.
    [[nodiscard]] float importance(unsigned level) const {
      if (level < ranking_->level_) return 0;
      if (!ranking_->view_) return float(level + 1);
      const float pixels = ranking_->volume_.object_error(supercube_, scale_, level) * pixels_;
      return pixels > ranking_->pixel_error_ ? pixels : 0;
    }
    // Ranks are importances in steps: the least importance of this rank, from 1 on; and the rank of an importance.
    [[nodiscard]] float least(Rank rank) const {
      if (!ranking_->view_) return float(rank);
      return rank + aside_ <= kLast ? std::numeric_limits<float>::denorm_min() : pixels_of(rank + aside_);
    }
    [[nodiscard]] Rank rank(float importance) const {
      if (importance == 0) return 0;
      return ranking_->view_ ? Rank(rank_of(importance) - aside_) : Rank(importance);
    }
    // No lower than that of any update here whose level of error is no higher.
    [[nodiscard]] Rank bound(unsigned level) const { return rank(importance(level)); }
    // Whether the diamond in a slot meets the region of interest.
    [[nodiscard]] bool meets_roi(int slot) const { return !ranking_->roi_ || ranking_->meets_roi(Diamond(centre_of(key_, slot))); }
    // Of an update, by number and slot.
    [[nodiscard]] Rank operator()(UpdateIndex i, int slot) const {
      return meets_roi(slot) ? rank(importance(ranking_->volume_.error_level(i))) : Rank(0);
    }

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    std::uint32_t supercube_ = 0;
    SupercubeKey key_ = 0;
    int scale_ = 0, aside_ = 0;
    float pixels_ = 0;  // of one world unit there
  };

  // Of one brick's supercubes.
  class Brick {
   public:
    // No lower than that of any update here.
    [[nodiscard]] Rank bound() const { return bound_; }
    [[nodiscard]] Supercube supercube(std::uint32_t supercube, SupercubeKey key) const;

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    int scale_ = 0, aside_ = 0;
    bool near_ = false;  // its supercubes are seen from distances that differ much
    float pixels_ = 0;
    Rank bound_ = 0;
  };
  [[nodiscard]] Brick of_brick(std::uint32_t brick) const {
    return of_brick(brick, volume_.brick_error_level(brick), volume_.brick_object_error(brick));
  }
  // Where only updates of no higher level, and no greater object error, matter any more.
  [[nodiscard]] Brick of_brick(std::uint32_t brick, unsigned level, float object_error) const;

  // What is left once all of a rank above this one is there: the field error, or the pixels on the screen, that updates of this rank have at most.
  [[nodiscard]] double bound(Rank rank) const;
  // The ranks from the result up to `top` are sent as one: errors on the screen differ by a factor of 2 at most, field errors by 4.
  [[nodiscard]] Rank band_below(Rank top) const;

  [[nodiscard]] bool has_camera() const { return view_.has_value(); }

 private:
  // Pixels as ranks: sixteen an octave. All that is less than the last has the last; none is above 2^100, so that bound() is a number
  // whatever the camera.
  static constexpr int kRankShift = 23 - 4, kRankFrom = (127 - 64) << 4, kBand = 16, kAside = 4, kLast = kAside + 1;
  [[nodiscard]] static Rank rank_of(float pixels) {
    const int rank = int(std::bit_cast<std::uint32_t>(pixels < 0x1p100f ? pixels : 0x1p100f) >> kRankShift) - kRankFrom;
    return Rank(rank < kLast ? kLast : rank);
  }
  // The least pixels of a rank, but for what aside_ takes off.
  [[nodiscard]] static float pixels_of(int rank) { return std::bit_cast<float>(std::uint32_t(rank + kRankFrom) << kRankShift); }
  [[nodiscard]] bool meets_roi(const Diamond& d) const;

  const IntervalVolume& volume_;
  unsigned level_ = 0;  // the lowest level of field error that is wanted
  struct SampleBox {
    std::array<double, 3> min, max;
  };
  std::optional<SampleBox> roi_;  // in samples
  std::optional<View> view_;
  float pixel_error_ = 0;
};

}  // namespace intervale
