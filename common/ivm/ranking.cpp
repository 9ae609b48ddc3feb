#include "common/ivm/ranking.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/ivm/refinement.h"

namespace intervale {
namespace {

// h, in pixels, of a diamond that is large on the screen; and how much larger counts.
constexpr double kLargePixels = 12, kLargest = 16;

constexpr float kLeastWeight = 1e-30F, kMostWeight = 1e30F;
float clamp_weight(double weight) { return float(std::clamp(weight, double(kLeastWeight), double(kMostWeight))); }

}  // namespace

Ranking::Ranking(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod, const DepthMap* hidden, const Camera* ahead)
    : volume_(volume), relevant_(relevant) {
  const double threshold = error_of(lod, volume.description().max_error);
  const auto steps = volume.error_steps();
  while (threshold > 0 && least_step_ < steps.size() && steps[least_step_] <= threshold) ++least_step_;
  const Grid& g = volume.description().grid;
  if (lod.roi) roi_ = std::make_unique<const SeenBox>(*lod.roi, g);
  if (lod.camera) {
    screen_.emplace(*lod.camera, g);
    if (hidden != nullptr) occlusion_ = std::make_unique<const Occlusion>(*hidden, *lod.camera, g);
    if (ahead != nullptr) ahead_ = std::make_unique<const ScreenError>(*ahead, g);
    pixel_error_ = float(lod.camera->pixel_error);
    const Vec3 spacing = g.affine.spacing();
    for (unsigned slope = 0; slope <= kMaxSlope; ++slope) removed_[slope] = removed_of(slope);
    spacing_ = std::cbrt(spacing[0]) * std::cbrt(spacing[1]) * std::cbrt(spacing[2]);
  }
}

std::size_t Ranking::memory_bytes() const {
  return (roi_ ? sizeof *roi_ : 0) + (ahead_ ? sizeof *ahead_ : 0) + (occlusion_ ? sizeof *occlusion_ + occlusion_->memory_bytes() : 0);
}

Ranking::Brick Ranking::of_brick(BrickIndex brick) const {
  Brick b;
  b.ranking_ = this;
  b.brick_ = brick;
  const SupercubeKey key = volume_.set().bricks()[brick].key;
  b.scale_ = scale_of_key(key);
  const RelevantUpdates::Bound all = relevant_.bound(brick);
  const unsigned step = all.error_step;
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
  if (!(all.object_error * b.pixels_ > pixel_error_)) return b;
  b.weight_ = weight_of(region, b.scale_, b.pixels_, b.is_exact_);
  b.is_seen_ = !is_hidden(region);
  b.bound_ = 1;
  b.bound_ = b.bound({.step = step, .object_error = all.object_error, .slope = all.slope});
  return b;
}

Ranking::BlockBounds::BlockBounds(const Ranking& ranking, Of of) : ranking_(ranking), of_(of) {
  if (!ranking.screen_ || (ranking.roi_ && of == Of::bricks)) return;
  const ScreenError::Regions& regions = of == Of::bricks ? ranking.volume_.brick_regions() : ranking.volume_.run_regions();
  now_.emplace(*ranking.screen_, regions);
  if (ranking.ahead_) soon_.emplace(*ranking.ahead_, regions);
}

// Without a camera; or of bricks that a region of interest may leave out.
void Ranking::BlockBounds::bound_each(std::size_t block, std::uint32_t which, const Block<Left>& left, Bounds& bounds) const {
  for (const std::size_t k : set_bits<std::size_t>(which)) {
    if (of_ == Of::runs) {
      bounds.rank[k] = left[k].step < ranking_.least_step_ ? Rank(0) : Rank(left[k].step + 1);
      continue;
    }
    const Brick b = ranking_.of_brick(BrickIndex(std::uint32_t(block * kBlock + k)));
    bounds.rank[k] = b.bound(left[k]);
    bounds.pixels[k] = ranking_.screen_ ? b.pixels(left[k].object_error) : 0;
  }
}

Ranking::BlockBounds::Bounds Ranking::BlockBounds::operator()(std::size_t block, std::uint32_t which, const Block<Left>& left) const {
  const Ranking& r = ranking_;
  Bounds bounds;
  if (!now_) {
    bound_each(block, which, left, bounds);
    return bounds;
  }
  const ScreenError::Bounds now = (*now_)(block);
  Block<float> width{}, removed{};  // width: h, in samples; the greatest of a run is that of its first brick
  for (const std::size_t k : set_bits<std::size_t>(which)) {
    const std::size_t first = (block * kBlock + k) * (of_ == Of::bricks ? 1 : RelevantUpdates::kRun);
    width[k] = float(1U << unsigned(scale_of_key(r.volume_.set().bricks()[first].key)));
    bounds.pixels[k] = std::clamp(left[k].object_error * now.pixels[k], kLeastImportance, kMostImportance);
    removed[k] = r.relevant_.has_slopes() ? r.removed_[left[k].slope_of_wanted(now.pixels[k], r.pixel_error_)] : bounds.pixels[k] * bounds.pixels[k];
  }
  Block<float> weight = weights(now, width);
  if (soon_) {
    const Block<float> soon = weights((*soon_)(block), width);
    for (std::size_t k = 0; k < kBlock; ++k) weight[k] = std::max(weight[k], soon[k]);
  }
  for (const std::size_t k : set_bits<std::size_t>(which)) {
    if (left[k].step < r.least_step_ || !(bounds.pixels[k] > r.pixel_error_)) continue;
    bounds.rank[k] = rank_of(std::max(removed[k] * weight[k], kLeastImportance), true);
  }
  return bounds;
}

// As weight_of() what is not exact, or a little more.
Ranking::BlockBounds::Block<float> Ranking::BlockBounds::weights(const ScreenError::Bounds& bounds, const Block<float>& width) const {
  const bool has_slopes = ranking_.relevant_.has_slopes();
  Block<float> weight;
  for (std::size_t k = 0; k < kBlock; ++k) {
    const auto spacing = float(std::min(ranking_.spacing_ * double(bounds.pixels[k]), 1e30));
    const float h = spacing * width[k], large = std::min(std::max(h / float(kLargePixels), 1.0F), float(kLargest));
    const float area = has_slopes ? spacing * spacing : h;
    const float whole = area * h * (large * large * large) * bounds.share[k] * (1 + 4e-6F);
    weight[k] = std::min(std::max(whole, kLeastWeight), kMostWeight);
  }
  return weight;
}

float Ranking::pixels_per_unit(const ScreenError& screen, const ScreenError::Region& region) {
  return float(std::min(screen.pixels_per_unit(region), double(kMostImportance)));
}

double Ranking::whole_weight(int scale, double pixels) const {
  const double spacing = spacing_ * pixels, h = spacing * double(std::uint64_t(1) << scale);
  const double large = std::clamp(h / kLargePixels, 1.0, kLargest);
  return (relevant_.has_slopes() ? spacing * spacing * h : h * h) * (large * large * large);
}

// Now or soon, the greater. If not exact, at most. pixels: of one world unit there, now.
float Ranking::weight_of(const ScreenError::Region& region, int scale, float pixels, bool is_exact) const {
  const auto on = [&](const ScreenError& screen, float pixels_there) {
    return whole_weight(scale, double(pixels_there)) * (is_exact ? screen.seen_share(region) : 1);
  };
  const double weight = on(*screen_, pixels);
  return clamp_weight(ahead_ ? std::max(weight, on(*ahead_, pixels_per_unit(*ahead_, region))) : weight);
}

Ranking::Supercube Ranking::Brick::rough(const BrickNeeds& needs, SupercubeIndex supercube, SupercubeKey key) const {
  Supercube s;
  s.ranking_ = ranking_;
  s.needs_ = &needs;
  s.number_ = supercube - ranking_->volume_.set().bricks()[brick_].first_supercube;
  s.to_distance_ = needs.to_distance(s.number_);
  s.supercube_ = supercube;
  s.key_ = key;
  s.scale_ = scale_;
  s.pixels_ = pixels_;
  s.weight_ = weight_;
  s.is_seen_ = is_seen_;
  s.has_own_weight_ = !is_exact_;
  s.may_be_hidden_ = ranking_->occlusion_ && is_seen_;
  if (is_exact_) return s;
  const ScreenError::Region region = region_of(ranking_->volume_.domain(), key, 1);
  if (near_) s.pixels_ = pixels_per_unit(*ranking_->screen_, region);
  s.weight_ = ranking_->weight_of(region, scale_, s.pixels_, false);
  return s;
}

void Ranking::Supercube::refine() {
  if (!has_own_weight_ && !may_be_hidden_) return;
  const ScreenError::Region region = region_of(ranking_->volume_.domain(), key_, 1);
  if (has_own_weight_) weight_ = ranking_->weight_of(region, scale_, pixels_, true);
  if (may_be_hidden_) is_seen_ = !ranking_->occlusion_->hides(region);
}

double Ranking::error(Rank rank) const { return rank == 0 ? 0 : double(volume_.error_steps()[rank - 1u]); }

Ranking::Rank Ranking::band_below(Rank top, bool is_rest, int width) const {
  if (screen_) {
    const int last = top > kSeenFrom ? kSeenFrom + 1 : 1;
    return Rank(is_rest ? last : std::max(last, top - kBand * width + 1));
  }
  if (is_rest) return 1;
  const auto steps = volume_.error_steps();
  const float low = steps[top - 1u] * 0.25F;
  return Rank(std::lower_bound(steps.begin(), steps.end(), low) - steps.begin() + 1);
}

}  // namespace intervale
