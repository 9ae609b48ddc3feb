// Which updates a level of detail wants for their own sake, not as an ancestor of another, and in which order. Pure: a
// function of the data set and the level of detail.
//
// Without a camera, updates are ranked by their field error; with one, by the deviation in pixels, on the screen, of
// the surfaces that they move. Pixels a world unit are computed once a supercube, or once a brick that is far away, for
// its nearest visible point.
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
  // volume and relevant, to the range that is looked at, must outlive it; lod: one that check_lod lets pass.
  Ranking(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod);
  // The same, for the range of the data set.
  Ranking(const IntervalVolume& volume, const Lod& lod) : Ranking(volume, volume.relevant(), lod) {}

  // 0: not wanted for its own sake. Otherwise what matters more has a higher rank.
  using Rank = std::uint16_t;

  // Ranks the updates of one supercube.
  class Supercube {
   public:
    // The importance of an update with this error step, with which it grows: 0 if it is not wanted for its own sake.
    // The region of interest is not considered.
    [[nodiscard]] float importance(unsigned step) const {
      if (step < ranking_->least_step_) return 0;
      if (!ranking_->screen_) return float(step + 1);
      const float pixels = ranking_->relevant_.object_error(supercube_, scale_, step) * pixels_;
      return pixels > ranking_->pixel_error_ ? pixels : 0;
    }
    // The least importance of this rank, 1 or more; and the rank of an importance.
    [[nodiscard]] float least(Rank rank) const {
      if (!ranking_->screen_) return float(rank);
      return rank + off_centre_ <= kLast ? std::numeric_limits<float>::denorm_min() : pixels_of(rank + off_centre_);
    }
    [[nodiscard]] Rank rank(float importance) const {
      if (importance == 0) return 0;
      return ranking_->screen_ ? Rank(rank_of(importance) - off_centre_) : Rank(importance);
    }
    // No lower than the rank of any update here whose error step is no higher.
    [[nodiscard]] Rank bound(unsigned step) const { return rank(importance(step)); }
    // Whether the diamond in a slot meets the region of interest.
    [[nodiscard]] bool meets_roi(Slot slot) const {
      return !ranking_->roi_ || ranking_->roi_->meets(centre_of(key_, slot), std::int32_t(1) << scale_);
    }
    // The rank of update i, in this slot.
    [[nodiscard]] Rank operator()(UpdateIndex i, Slot slot) const {
      return meets_roi(slot) ? rank(importance(ranking_->volume_.error_step(i))) : Rank(0);
    }

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    SupercubeIndex supercube_;
    SupercubeKey key_ = 0;
    int scale_ = 0, off_centre_ = 0;
    float pixels_ = 0;  // of one world unit
  };

  // Ranks the supercubes of one brick.
  class Brick {
   public:
    // No lower than the rank of any update here.
    [[nodiscard]] Rank bound() const { return bound_; }
    [[nodiscard]] Supercube supercube(SupercubeIndex supercube, SupercubeKey key) const;

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    int scale_ = 0, off_centre_ = 0;
    bool near_ = false;  // distances from the camera to its supercubes differ much
    float pixels_ = 0;
    Rank bound_ = 0;
  };
  [[nodiscard]] Brick of_brick(BrickIndex brick) const {
    return of_brick(brick, relevant_.brick_error_step(brick), relevant_.brick_object_error(brick));
  }
  // The same, if only updates with no higher error step and no larger object error remain.
  [[nodiscard]] Brick of_brick(BrickIndex brick, unsigned step, float object_error) const;

  // The error that remains once all updates of higher ranks are applied: the largest field error, or the pixels on the
  // screen, of this rank.
  [[nodiscard]] double bound(Rank rank) const;
  // The lowest rank of the band that is sent as one with `top`: errors on the screen differ by a factor of 2 at most,
  // field errors by 4.
  [[nodiscard]] Rank band_below(Rank top) const;

  [[nodiscard]] bool has_camera() const { return screen_.has_value(); }

 private:
  // Pixels as ranks: sixteen an octave, from the bits of the float. The lowest is kLast; pixels are capped at 2^100, so
  // that bound() is finite for any camera. Outside the middle of the picture, ranks are lower by kOffCentre.
  static constexpr int kRankShift = 23 - 4, kRankFrom = (127 - 64) << 4, kBand = 16, kOffCentre = 4, kLast = kOffCentre + 1;
  [[nodiscard]] static Rank rank_of(float pixels) {
    const int rank = int(std::bit_cast<std::uint32_t>(pixels < 0x1p100f ? pixels : 0x1p100f) >> kRankShift) - kRankFrom;
    return Rank(rank < kLast ? kLast : rank);
  }
  // The least pixels of a rank in the middle of the picture.
  [[nodiscard]] static float pixels_of(int rank) { return std::bit_cast<float>(std::uint32_t(rank + kRankFrom) << kRankShift); }

  const IntervalVolume& volume_;
  const RelevantUpdates& relevant_;
  unsigned least_step_ = 0;  // the lowest error step that is wanted
  std::optional<SeenBox> roi_;
  std::optional<ScreenError> screen_;
  float pixel_error_ = 0;
};

}  // namespace intervale
