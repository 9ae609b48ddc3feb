#include "common/ivm/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/ivm/refinement.h"

namespace intervale {
namespace {

// h, in pixels, of a diamond that is large on the screen; and how much larger counts.
constexpr double kLargePixels = 12, kLargest = 16;

}  // namespace

Ranking::Ranking(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod, const DepthMap* hidden, const Camera* ahead)
    : volume_(volume), relevant_(relevant) {
  const double threshold = error_of(lod, volume.description().max_error);
  const auto steps = volume.error_steps();
  while (threshold > 0 && least_step_ < steps.size() && steps[least_step_] <= threshold) ++least_step_;
  const Grid& g = volume.description().grid;
  if (lod.roi) roi_.emplace(*lod.roi, g);
  if (lod.camera) {
    screen_.emplace(*lod.camera, g);
    if (hidden != nullptr) occlusion_.emplace(*hidden, *lod.camera, g);
    if (ahead != nullptr) ahead_.emplace(*ahead, g);
    pixel_error_ = float(lod.camera->pixel_error);
    const Vec3 spacing = g.affine.spacing();
    for (unsigned slope = 0; slope <= kMaxSlope; ++slope) removed_[slope] = removed_of(slope);
    spacing_ = std::cbrt(spacing[0]) * std::cbrt(spacing[1]) * std::cbrt(spacing[2]);
  }
}

Ranking::Brick Ranking::of_brick(BrickIndex brick, unsigned step, float object_error, unsigned slope) const {
  Brick b;
  b.ranking_ = this;
  const SupercubeKey key = volume_.set().bricks()[brick].key;
  b.scale_ = scale_of_key(key);
  if (step < least_step_) return b;
  if (!roi_ && !screen_) {
    b.bound_ = Rank(step + 1);
    return b;
  }
  const ScreenError::Region region = region_of(volume_.domain(), key, 4);
  if (roi_ && !roi_->meets(region.middle, region.reach)) return b;
  if (!screen_) {
    b.bound_ = Rank(step + 1);
    return b;
  }
  b.pixels_ = pixels_per_unit(*screen_, region);
  b.near_ = screen_->is_near(region);
  b.is_exact_ = !b.near_ && !(ahead_ && ahead_->is_near(region));
  const float pixels = object_error * b.pixels_;
  if (!(pixels > pixel_error_)) return b;
  b.weight_ = weight_of(region, b.scale_, b.pixels_, b.is_exact_);
  b.is_seen_ = !is_hidden(region);
  b.bound_ = rank_of(importance_of(pixels, slope, b.weight_), b.is_seen_);
  return b;
}

float Ranking::pixels_per_unit(const ScreenError& screen, const ScreenError::Region& region) {
  return float(std::min(screen.pixels_per_unit(region), double(kMostImportance)));
}

// If not exact, at most. pixels: of one world unit there.
double Ranking::weight_on(const ScreenError& screen, const ScreenError::Region& region, int scale, double pixels, bool is_exact) const {
  const double spacing = spacing_ * pixels;
  const double weight = relevant_.has_slopes() ? std::ldexp(spacing * spacing * spacing, scale) : std::ldexp(spacing * spacing, 2 * scale);
  const double large = std::clamp(std::ldexp(spacing, scale) / kLargePixels, 1.0, kLargest);
  return weight * large * large * large * (is_exact ? screen.seen_share(region) : 1);
}

// The same, now or soon: the greater.
float Ranking::weight_of(const ScreenError::Region& region, int scale, float pixels, bool is_exact) const {
  double weight = weight_on(*screen_, region, scale, double(pixels), is_exact);
  if (ahead_) weight = std::max(weight, weight_on(*ahead_, region, scale, double(pixels_per_unit(*ahead_, region)), is_exact));
  return float(std::clamp(weight, 1e-30, 1e30));
}

Ranking::Supercube Ranking::Brick::supercube(SupercubeIndex supercube, SupercubeKey key) const {
  Supercube s;
  s.ranking_ = ranking_;
  s.supercube_ = supercube;
  s.key_ = key;
  s.scale_ = scale_;
  s.pixels_ = pixels_;
  s.weight_ = weight_;
  s.is_seen_ = is_seen_;
  const bool may_be_hidden = ranking_->occlusion_ && is_seen_;
  if (is_exact_ && !may_be_hidden) return s;
  const ScreenError::Region region = region_of(ranking_->volume_.domain(), key, 1);
  if (near_) s.pixels_ = pixels_per_unit(*ranking_->screen_, region);
  if (!is_exact_) s.weight_ = ranking_->weight_of(region, scale_, s.pixels_, true);
  if (may_be_hidden) s.is_seen_ = !ranking_->occlusion_->hides(region);
  return s;
}

double Ranking::error(Rank rank) const { return rank == 0 ? 0 : double(volume_.error_steps()[rank - 1u]); }

Ranking::Rank Ranking::band_below(Rank top) const {
  if (screen_) return Rank(std::max(top > kSeenFrom ? kSeenFrom + 1 : 1, top - kBand + 1));
  const auto steps = volume_.error_steps();
  const float low = steps[top - 1u] * 0.25F;
  return Rank(std::lower_bound(steps.begin(), steps.end(), low) - steps.begin() + 1);
}

}  // namespace intervale
