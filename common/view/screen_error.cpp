#include "common/view/screen_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace intervale {
namespace {

// Errors shrink to 1 / (1 + kFade) at a right angle to the edge of the picture, and beyond.
constexpr double kFade = 15;

double reach_along(const Vec3& reach, const Vec3& n) { return reach[0] * std::abs(n[0]) + reach[1] * std::abs(n[1]) + reach[2] * std::abs(n[2]); }

}  // namespace

ScreenError::ScreenError(const Camera& camera, const Grid& grid) : turned_(grid.affine), eye_(turned_.turned(camera.eye)) {
  const Vec3 ahead = normalized(subtract(camera.look_at, camera.eye)), right = normalized(cross(ahead, normalized(camera.up)));
  ahead_ = turned_.turned(ahead);
  right_ = turned_.turned(right);
  up_ = turned_.turned(cross(right, ahead));
  tan_y_ = std::tan(camera.fov * (std::numbers::pi / 360));
  tan_x_ = tan_y_ * camera.viewport[0] / camera.viewport[1];
  scale_ = camera.viewport[1] / (2 * tan_y_);
  cos_corner_ = 1 / std::hypot(1.0, tan_x_, tan_y_);
  const Vec3 spacing = grid.affine.spacing();
  least_depth_ = 1e-3 * std::min({spacing[0], spacing[1], spacing[2]});
  const auto side = [this](const Vec3& across, double sign, double tangent) {
    Vec3 n, e;
    for (int i = 0; i < 3; ++i) {
      n[i] = tangent * ahead_[i] + sign * across[i];
      e[i] = ahead_[i] - sign * tangent * across[i];
    }
    return Side{normalized(n), normalized(e)};
  };
  sides_ = {side(right_, 1, tan_x_), side(right_, -1, tan_x_), side(up_, 1, tan_y_), side(up_, -1, tan_y_)};
}

double ScreenError::pixels_per_unit(const Region& region) const {
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_), reach = turned_.map.reach(region.reach);
  double gap2 = 0, far2 = 0;  // to the nearest point of the region, and to its furthest corner
  for (int i = 0; i < 3; ++i) {
    const double gap = std::max(0.0, std::abs(at[i]) - reach[i]);
    gap2 += gap * gap;
    far2 += (std::abs(at[i]) + reach[i]) * (std::abs(at[i]) + reach[i]);
  }
  // The visible part of the region is no nearer than that.
  const double depth = std::max({dot(at, ahead_) - reach_along(reach, ahead_), std::sqrt(gap2) * cos_corner_, least_depth_});
  // The distance of the whole region beyond a side of the view frustum; behind a right angle, from the side's middle
  // line.
  double outside = 0;
  for (const Side& s : sides_) {
    const double beyond = -dot(at, s.inward) - reach_along(reach, s.inward), behind = -dot(at, s.edge) - reach_along(reach, s.edge);
    if (beyond > 0) outside = std::max(outside, behind > 0 ? std::hypot(beyond, behind) : beyond);
  }
  if (outside == 0) return scale_ / depth;
  return scale_ / (depth * (1 + kFade * outside / std::sqrt(far2)));
}

bool ScreenError::is_near(const Region& region) const {
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_), reach = turned_.map.reach(region.reach);
  double across2 = 0, gap2 = 0;
  for (int i = 0; i < 3; ++i) {
    const double gap = std::max(0.0, std::abs(at[i]) - reach[i]);
    across2 += 4 * reach[i] * reach[i];
    gap2 += gap * gap;
  }
  return gap2 < 9 * across2;
}

bool ScreenError::is_central(const Region& region) const {
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_);
  const double depth = dot(at, ahead_);
  return std::abs(dot(at, right_)) <= tan_x_ / 2 * depth && std::abs(dot(at, up_)) <= tan_y_ / 2 * depth;
}

// Diamonds extend below their supercube by h, and not above it.
ScreenError::Region region_of(const Domain& domain, SupercubeKey key, std::int32_t cells) {
  const int scale = scale_of_key(key);
  const Vertex p = position_of_key(key), last = domain.last();
  const std::int32_t h = 1 << scale;
  ScreenError::Region region;
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

}  // namespace intervale
