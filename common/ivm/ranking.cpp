#include "common/ivm/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/ivm/refinement.h"

namespace intervale {

Ranking::Ranking(const IntervalVolume& volume, const Lod& lod) : volume_(volume) {
  const double threshold = error_of(lod, volume.description().max_error);
  const auto levels = volume.error_levels();
  while (threshold > 0 && level_ < levels.size() && levels[level_] <= threshold) ++level_;
  const Grid& g = volume.description().grid;
  if (lod.roi) {
    roi_.emplace();
    for (int i = 0; i < 3; ++i) {
      roi_->min[i] = (lod.roi->min[i] - g.origin[i]) / g.spacing[i];
      roi_->max[i] = (lod.roi->max[i] - g.origin[i]) / g.spacing[i];
      // Beyond the samples there is nothing to refine.
      if (roi_->min[i] > g.dims[i] - 1) roi_->min[i] = std::numeric_limits<double>::infinity();
      if (roi_->max[i] < 0) roi_->max[i] = -std::numeric_limits<double>::infinity();
    }
  }
  if (lod.camera) {
    view_.emplace(*lod.camera, g);
    pixel_error_ = float(lod.camera->pixel_error);
  }
}

bool Ranking::meets_roi(const Diamond& d) const {
  const double c[3] = {double(d.centre.x), double(d.centre.y), double(d.centre.z)};
  for (int i = 0; i < 3; ++i) {
    if (c[i] + d.h < roi_->min[i] || c[i] - d.h > roi_->max[i]) return false;
  }
  return true;
}

Ranking::Brick Ranking::of_brick(std::uint32_t brick, unsigned level, float object_error) const {
  Brick b;
  b.ranking_ = this;
  const SupercubeKey key = volume_.set().bricks()[brick].key;
  b.scale_ = scale_of_key(key);
  if (level < level_) return b;
  if (!roi_ && !view_) {
    b.bound_ = Rank(level + 1);
    return b;
  }
  const View::Region region = region_of(volume_.domain(), key, 4);
  for (int i = 0; i < 3 && roi_; ++i) {
    if (region.middle[i] + region.reach[i] < roi_->min[i] || region.middle[i] - region.reach[i] > roi_->max[i]) return b;
  }
  if (!view_) {
    b.bound_ = Rank(level + 1);
    return b;
  }
  b.pixels_ = float(view_->pixels_per_unit(region));
  b.near_ = view_->is_near(region);
  const float pixels = object_error * b.pixels_;
  if (pixels > pixel_error_) b.bound_ = rank_of(pixels);
  b.aside_ = view_->is_central(region) ? 0 : kAside;  // the middle of the picture a little sooner
  if (!b.near_ && b.bound_ != 0) b.bound_ = Rank(b.bound_ - b.aside_);
  return b;
}

Ranking::Supercube Ranking::Brick::supercube(std::uint32_t supercube, SupercubeKey key) const {
  Supercube s;
  s.ranking_ = ranking_;
  s.supercube_ = supercube;
  s.key_ = key;
  s.scale_ = scale_;
  s.pixels_ = pixels_;
  s.aside_ = aside_;
  if (near_) {
    const View::Region region = region_of(ranking_->volume_.domain(), key, 1);
    s.pixels_ = float(ranking_->view_->pixels_per_unit(region));
    s.aside_ = ranking_->view_->is_central(region) ? 0 : kAside;
  }
  return s;
}

double Ranking::bound(Rank rank) const {
  if (rank == 0) return 0;
  if (!view_) return double(volume_.error_levels()[rank - 1u]);
  return double(pixels_of(rank + 1 + kAside));
}

Ranking::Rank Ranking::band_below(Rank top) const {
  if (view_) return Rank(std::max(1, top - kBand + 1));
  const auto levels = volume_.error_levels();
  const float low = levels[top - 1u] * 0.25F;
  return Rank(std::lower_bound(levels.begin(), levels.end(), low) - levels.begin() + 1);
}

}  // namespace intervale
