// Which updates a level of detail wants for their own sake, not as an ancestor of another, and in which order. Pure: a
// function of the data set and the level of detail.
//
// Without a camera, updates are ranked by their field error. With one, those are wanted that move surfaces by more than
// its pixel error; they are ranked by the squared deviation on the screen that they remove, summed up over the picture.
// Where slopes are known (relevant_updates.h), that is what they say, times the cube of the spacing of samples in
// pixels: its square, as deviations are seen so large; and its square once more, if all pixels should count alike, but
// not, if all of the surface should. Once more with 2^scale: coarse updates come a little earlier than what they remove
// says, which makes early pictures better and later ones no worse. Otherwise it is estimated: the square of the
// deviation in pixels, times the pixels that the diamond's surfaces cover, about (h in pixels)^2. Diamonds that are
// large on the screen come earlier still, by the cube of their size: one part that is left coarse spoils a first
// picture more than others that are refined improve it. All of that as far as the surfaces are in the picture. So what
// is large in the picture comes before what is far off in one place. If the camera moves, the weight of what is removed
// is that of now or that of soon, whichever is greater. What a depth map hides comes after everything that is seen.
// Pixels a world unit, for the nearest visible point, and the share that is seen are computed once a supercube, or once
// a brick that is far away.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"
#include "common/view/depth_map.h"
#include "common/view/lod.h"
#include "common/view/screen_error.h"
#include "common/view/seen_box.h"

namespace intervale {

class Ranking {
 public:
  // volume and relevant, to the range that is looked at, must outlive it; lod: one that check_lod lets pass. hidden: of
  // its camera; what lies behind comes last. ahead: where the camera will be soon, which changes ranks but not what is
  // wanted; it is like lod's.
  Ranking(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod, const DepthMap* hidden = nullptr,
          const Camera* ahead = nullptr);
  // The same, for the range of the data set.
  Ranking(const IntervalVolume& volume, const Lod& lod) : Ranking(volume, volume.relevant(), lod) {}

  // 0: not wanted for its own sake. Otherwise what matters more has a higher rank.
  using Rank = std::uint16_t;
  static constexpr unsigned kRankBits = 13;  // of the highest rank

  // Ranks the updates of one supercube.
  class Supercube {
   public:
    // The importance of an update with this error step, distance and slope, with which it grows: 0 if it is not wanted
    // for its own sake. The region of interest is not considered.
    [[nodiscard]] float importance(unsigned step, std::uint8_t distance, unsigned slope) const {
      if (step < ranking_->least_step_) return 0;
      if (!ranking_->screen_) return float(step + 1);
      const float pixels = ranking_->relevant_.object_error(to_distance_, scale_, step, distance) * pixels_;
      return pixels > ranking_->pixel_error_ ? ranking_->importance_of(pixels, slope, weight_) : 0;
    }
    // The least importance of this rank, 1 or more; and the rank of an importance.
    [[nodiscard]] float least(Rank rank) const {
      if (!ranking_->screen_) return float(rank);
      const int among_its_kind = int(rank) - is_seen_ * kSeenFrom;
      if (among_its_kind > kSeenFrom) return std::numeric_limits<float>::infinity();  // none that is hidden
      return among_its_kind <= 1 ? kLeastImportance : bits_as<float>(std::uint32_t(among_its_kind + kRankFrom) << kRankShift);
    }
    [[nodiscard]] Rank rank(float importance) const {
      if (importance == 0) return 0;
      return ranking_->screen_ ? rank_of(importance, is_seen_) : Rank(importance);
    }
    // No lower than the rank of any update here whose error step, distance and slope are no higher.
    [[nodiscard]] Rank bound(unsigned step, std::uint8_t distance, unsigned slope) const { return rank(importance(step, distance, slope)); }
    // Makes a rough ranking exact.
    void refine();
    // Whether the diamond in a slot meets the region of interest.
    [[nodiscard]] bool meets_roi(Slot slot) const {
      return !ranking_->roi_ || ranking_->roi_->meets(centre_of(key_, slot), std::int32_t(1) << scale_);
    }
    // The rank of update i, a relevant one in this slot.
    [[nodiscard]] Rank operator()(UpdateIndex i, Slot slot) const {
      if (!meets_roi(slot)) return 0;
      const std::uint64_t relevant = needs_->slots(number_, ranking_->volume_.set().occupancy()[supercube_]);
      const BrickNeeds::OfUpdate own = needs_->of_update(number_, relevant, slot);
      return rank(importance(ranking_->volume_.error_step(i), own.distance, own.slope));
    }

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    const BrickNeeds* needs_ = nullptr;  // of its brick
    std::size_t number_ = 0;             // in its brick
    SupercubeIndex supercube_;
    SupercubeKey key_ = 0;
    int scale_ = 0;
    ErrorToDistance to_distance_;
    float pixels_ = 0;  // of one world unit
    float weight_ = 0;  // of what is removed
    bool is_seen_ = true;
    bool has_own_weight_ = true, may_be_hidden_ = false;  // not those of the brick; see refine()
  };

  // Upper bounds over updates that are left. slope: of those whose object errors are above the limit; slope_below: of
  // the others. While these are hardly wanted, with object errors of at most kHardly times what is wanted, they come
  // last, however steep they are.
  struct Left {
    static constexpr float kHardly = 1.7F;
    unsigned step = 0;
    float object_error = 0;
    unsigned slope = 0;
    float limit = 0;
    unsigned slope_below = 0;
    // pixels: of one world unit, at most. pixel_error: what is above is wanted.
    [[nodiscard]] unsigned slope_of_wanted(float pixels, float pixel_error) const {
      return limit * pixels > kHardly * pixel_error ? std::max(slope, slope_below) : slope;
    }
  };

  // Ranks the supercubes of one brick.
  class Brick {
   public:
    // No lower than the rank of any update here; the same, if only these remain.
    [[nodiscard]] Rank bound() const { return bound_; }
    [[nodiscard]] Rank bound(const Left& left) const {
      if (bound_ == 0 || left.step < ranking_->least_step_) return 0;
      if (!ranking_->screen_) return Rank(left.step + 1);
      const float pixels = left.object_error * pixels_;
      if (!(pixels > ranking_->pixel_error_)) return 0;
      return rank_of(ranking_->importance_of(pixels, left.slope_of_wanted(pixels_, ranking_->pixel_error_), weight_), is_seen_);
    }
    // With a camera: about the largest object error that is not wanted here.
    [[nodiscard]] float unwanted() const { return ranking_->pixel_error_ / pixels_; }
    // needs: of the brick, must outlive it.
    [[nodiscard]] Supercube supercube(const BrickNeeds& needs, SupercubeIndex supercube, SupercubeKey key) const {
      Supercube s = rough(needs, supercube, key);
      s.refine();
      return s;
    }
    // The same in half of the time, with ranks that may be too high, until it is refined: as if all of the supercube
    // were seen.
    [[nodiscard]] Supercube rough(const BrickNeeds& needs, SupercubeIndex supercube, SupercubeKey key) const;
    // With a camera: no less than the deviation in pixels of any update here whose object error is no larger, or 2^100.
    // Above 0.
    [[nodiscard]] float pixels(float object_error) const { return std::clamp(object_error * pixels_, kLeastImportance, kMostImportance); }

   private:
    friend class Ranking;
    const Ranking* ranking_ = nullptr;
    BrickIndex brick_;
    int scale_ = 0;
    bool near_ = false;     // distances from the camera to its supercubes differ much
    bool is_exact_ = true;  // the weight is that of its supercubes, too
    bool is_seen_ = true;   // some of it, perhaps
    float pixels_ = 0, weight_ = 0;
    Rank bound_ = 0;
  };
  [[nodiscard]] Brick of_brick(BrickIndex brick) const;

  // Bounds of bricks, or of runs of them (RelevantUpdates::kRun), by block: no lower than the rank of any update there,
  // in a fraction of the time that of_brick() takes. What is inside the picture and far away is taken for as near as
  // its nearest point; what is hidden, for seen.
  class BlockBounds {
   public:
    enum class Of { bricks, runs };
    static constexpr std::size_t kBlock = ScreenError::Regions::kBlock;
    template <class T>
    using Block = std::array<T, kBlock>;
    struct Bounds {
      Block<Rank> rank{};
      Block<float> pixels{};  // as Brick::pixels(); 0 without a camera
    };
    // ranking: must outlive it.
    BlockBounds(const Ranking& ranking, Of of);
    // Of some bricks or runs from `block` * kBlock on, a bit each; the others' ranks are 0. left: of their updates.
    [[nodiscard]] Bounds operator()(std::size_t block, std::uint32_t which, const Block<Left>& left) const;
    [[nodiscard]] bool is_exact() const { return of_ == Of::bricks && !now_; }  // ranks are those of Brick::bound()

   private:
    void bound_each(std::size_t block, std::uint32_t which, const Block<Left>& left, Bounds& bounds) const;
    [[nodiscard]] Block<float> weights(const ScreenError::Bounds& bounds, const Block<float>& width) const;
    const Ranking& ranking_;
    Of of_;
    std::optional<ScreenError::RegionBounds> now_, soon_;
  };

  // Without a camera: the largest field error that remains once all updates of higher ranks are applied.
  [[nodiscard]] double error(Rank rank) const;
  // The lowest rank of the band that is sent as one with `top`: field errors, and with a camera importances, differ by
  // a factor of 4 at most, or with a camera of 4^width. is_rest: of all further ones that are sent, but for those that
  // are hidden if top is not.
  [[nodiscard]] Rank band_below(Rank top, bool is_rest = false, int width = 1) const;
  static constexpr int kMostWidth = 128;  // a band of all that is seen, or of all that is hidden

  [[nodiscard]] bool has_camera() const { return screen_.has_value(); }
  [[nodiscard]] std::size_t memory_bytes() const;  // besides this object

 private:
  static constexpr float kLeastImportance = std::numeric_limits<float>::min(), kMostImportance = 0x1p100f;
  // Above 0.
  [[nodiscard]] float importance_of(float pixels, unsigned slope, float weight) const {
    return std::max((relevant_.has_slopes() ? removed_[slope] : pixels * pixels) * weight, kLeastImportance);
  }
  // Importances as ranks: sixteen an octave, from the bits of the float. The lowest is 1. All that is seen ranks above
  // all that is hidden.
  static constexpr int kRankShift = 23 - 4, kRankFrom = (127 - 64) << 4, kBand = 32, kSeenFrom = 4096;
  static_assert(((127 + 100) << 4) - kRankFrom + kSeenFrom < 1 << kRankBits, "of kMostImportance");
  [[nodiscard]] static Rank rank_of(float importance, bool is_seen) {
    const int rank = int(bits_as<std::uint32_t>(importance < kMostImportance ? importance : kMostImportance) >> kRankShift) - kRankFrom;
    return Rank(std::max(rank, 1) + is_seen * kSeenFrom);
  }
  [[nodiscard]] static float pixels_per_unit(const ScreenError& screen, const ScreenError::Region& region);
  [[nodiscard]] bool is_hidden(const ScreenError::Region& region) const { return occlusion_ && occlusion_->hides(region); }
  // Of diamonds of this scale where a world unit has so many pixels, as if all of it were seen from there.
  [[nodiscard]] double whole_weight(int scale, double pixels) const;
  [[nodiscard]] float weight_of(const ScreenError::Region& region, int scale, float pixels, bool is_exact) const;

  const IntervalVolume& volume_;
  const RelevantUpdates& relevant_;
  unsigned least_step_ = 0;  // the lowest error step that is wanted
  std::optional<ScreenError> screen_;
  // What few views have takes no memory otherwise.
  std::unique_ptr<const SeenBox> roi_;
  std::unique_ptr<const ScreenError> ahead_;  // soon
  std::unique_ptr<const Occlusion> occlusion_;
  float pixel_error_ = 0;
  double spacing_ = 0;                          // between samples, the geometric mean over the axes
  std::array<float, kMaxSlope + 1> removed_{};  // by slope
};

}  // namespace intervale
