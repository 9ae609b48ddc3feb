#include "common/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/refinement.h"

namespace intervale {

Ranking::Ranking(const IntervalVolume& volume, const Lod& lod) : volume_(volume) {
  const double threshold = error_of(lod, volume.description());
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

// The diamonds of a cube of `cells` supercubes a side, from that with this key on: they reach h further down, and no further up.
View::Region Ranking::region_of(SupercubeKey key, std::int32_t cells) const {
  const int scale = scale_of_key(key);
  const Vertex p = position_of_key(key), last = volume_.domain().last();
  const std::int32_t h = 1 << scale;
  View::Region region;
  const auto along = [&](int axis, std::int32_t at, std::int32_t end) {
    const double low = std::max(0.0, 4.0 * at * h - h), high = std::min(double(end), 4.0 * (at + cells) * h);
    region.middle[axis] = (low + high) / 2;
    region.reach[axis] = std::max(0.0, (high - low) / 2);
  };
  along(0, p.x, last.x);
  along(1, p.y, last.y);
  along(2, p.z, last.z);
  return region;
}

bool Ranking::meets_roi(const Diamond& d) const {
  const double c[3] = {double(d.centre.x), double(d.centre.y), double(d.centre.z)};
  for (int i = 0; i < 3; ++i) {
    if (c[i] + d.h < roi_->min[i] || c[i] - d.h > roi_->max[i]) return false;
  }
  return true;
}

Ranking::Rank Ranking::of_brick(std::uint32_t brick) const {
  const unsigned level = volume_.brick_error_level(brick);
  if (level < level_) return 0;
  const SupercubeKey key = volume_.set().bricks()[brick].key;
  if (!roi_ && !view_) return Rank(level + 1);
  const View::Region region = region_of(key, 4);
  for (int i = 0; i < 3 && roi_; ++i) {
    if (region.middle[i] + region.reach[i] < roi_->min[i] || region.middle[i] - region.reach[i] > roi_->max[i]) return 0;
  }
  if (!view_) return Rank(level + 1);
  const float pixels = volume_.brick_object_error(brick) * float(view_->pixels_per_unit(region));
  return pixels > pixel_error_ ? rank_of(pixels) : 0;
}

Ranking::Supercube Ranking::of_supercube(std::uint32_t supercube, SupercubeKey key) const {
  Supercube s(*this, supercube, key);
  s.scale_ = scale_of_key(key);
  if (view_) {
    const View::Region region = region_of(key, 1);
    s.pixels_ = float(view_->pixels_per_unit(region));
    s.central_ = view_->is_central(region);
  }
  return s;
}

Ranking::Rank Ranking::Supercube::operator()(UpdateIndex i, int slot) const {
  const IntervalVolume& volume = ranking_.volume_;
  const unsigned level = volume.error_level(i);
  if (level < ranking_.level_) return 0;
  if (ranking_.roi_ && !ranking_.meets_roi(Diamond(centre_of(key_, slot)))) return 0;
  if (!ranking_.view_) return Rank(level + 1);
  const float pixels = volume.object_error(supercube_, scale_, i) * pixels_;
  if (!(pixels > ranking_.pixel_error_)) return 0;
  return Rank(rank_of(pixels) - (central_ ? 0 : kAside));  // the middle of the picture a little sooner
}

double Ranking::bound(Rank rank) const {
  if (rank == 0) return 0;
  if (!view_) return double(volume_.error_levels()[rank - 1u]);
  return double(std::bit_cast<float>(std::uint32_t(rank + 1 + kAside + kRankFrom) << kRankShift));
}

Ranking::Rank Ranking::band_below(Rank top) const {
  if (view_) return Rank(std::max(1, top - kBand + 1));
  const auto levels = volume_.error_levels();
  const float low = levels[top - 1u] * float(std::sqrt(0.5));
  return Rank(std::lower_bound(levels.begin(), levels.end(), low) - levels.begin() + 1);
}

}  // namespace intervale
