#include "common/ivm/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/ivm/refinement.h"

namespace intervale {

Ranking::Ranking(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod) : volume_(volume), relevant_(relevant) {
  const double threshold = error_of(lod, volume.description().max_error);
  const auto steps = volume.error_steps();
  while (threshold > 0 && least_step_ < steps.size() && steps[least_step_] <= threshold) ++least_step_;
  const Grid& g = volume.description().grid;
  if (lod.roi) roi_.emplace(*lod.roi, g);
  if (lod.camera) {
    screen_.emplace(*lod.camera, g);
    pixel_error_ = float(lod.camera->pixel_error);
  }
}

Ranking::Brick Ranking::of_brick(BrickIndex brick, unsigned step, float object_error) const {
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
  b.pixels_ = float(screen_->pixels_per_unit(region));
  b.near_ = screen_->is_near(region);
  const float pixels = object_error * b.pixels_;
  if (pixels > pixel_error_) b.bound_ = rank_of(pixels);
  b.off_centre_ = screen_->is_central(region) ? 0 : kOffCentre;  // the middle of the picture comes a little sooner
  if (!b.near_ && b.bound_ != 0) b.bound_ = Rank(b.bound_ - b.off_centre_);
  return b;
}

Ranking::Supercube Ranking::Brick::supercube(SupercubeIndex supercube, SupercubeKey key) const {
  Supercube s;
  s.ranking_ = ranking_;
  s.supercube_ = supercube;
  s.key_ = key;
  s.scale_ = scale_;
  s.pixels_ = pixels_;
  s.off_centre_ = off_centre_;
  if (near_) {
    const ScreenError::Region region = region_of(ranking_->volume_.domain(), key, 1);
    s.pixels_ = float(ranking_->screen_->pixels_per_unit(region));
    s.off_centre_ = ranking_->screen_->is_central(region) ? 0 : kOffCentre;
  }
  return s;
}

double Ranking::bound(Rank rank) const {
  if (rank == 0) return 0;
  if (!screen_) return double(volume_.error_steps()[rank - 1u]);
  return double(pixels_of(rank + 1 + kOffCentre));
}

Ranking::Rank Ranking::band_below(Rank top) const {
  if (screen_) return Rank(std::max(1, top - kBand + 1));
  const auto steps = volume_.error_steps();
  const float low = steps[top - 1u] * 0.25F;
  return Rank(std::lower_bound(steps.begin(), steps.end(), low) - steps.begin() + 1);
}

}  // namespace intervale
