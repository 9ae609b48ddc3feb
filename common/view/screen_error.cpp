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
  const Vec3 to_right = turned_.turned(right), to_top = turned_.turned(cross(right, ahead));
  // Of half the angles of view
  const double tan_y = std::tan(camera.fov * (std::numbers::pi / 360)), tan_x = tan_y * camera.viewport[0] / camera.viewport[1];
  scale_ = camera.viewport[1] / (2 * tan_y);
  cos_corner_ = 1 / std::hypot(1.0, tan_x, tan_y);
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
  sides_ = {side(to_right, 1, tan_x), side(to_right, -1, tan_x), side(to_top, 1, tan_y), side(to_top, -1, tan_y)};
}

double ScreenError::least_depth_of(const Vec3& at, const Vec3& reach) const {
  double gap2 = 0;  // to the nearest point of the region
  for (int i = 0; i < 3; ++i) {
    const double gap = std::max(0.0, std::abs(at[i]) - reach[i]);
    gap2 += gap * gap;
  }
  return std::max({dot(at, ahead_) - reach_along(reach, ahead_), std::sqrt(gap2) * cos_corner_, least_depth_});
}

double ScreenError::pixels_per_unit(const Region& region) const {
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_), reach = turned_.map.reach(region.reach);
  const double depth = least_depth_of(at, reach);
  double far2 = 0;  // to the region's furthest corner
  for (int i = 0; i < 3; ++i) far2 += (std::abs(at[i]) + reach[i]) * (std::abs(at[i]) + reach[i]);
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

double ScreenError::seen_share(const Region& region) const {
  constexpr double kLeast = 1e-6;
  const Vec3 at = subtract(turned_.map.point(region.middle), eye_), whole_reach = turned_.map.reach(region.reach);
  const Vec3 reach = scaled(1.0 / 3, whole_reach);  // of a part
  // Distances from the planes through the eye that bound the picture, and from that across the line of sight.
  struct Distance {
    double of_middle = 0, reach = 0;
    Vec3 step{};  // from a part to the next, along each axis of the samples
    [[nodiscard]] double of_part(int x, int y, int z) const { return of_middle + x * step[0] + y * step[1] + z * step[2]; }
  };
  const auto from_plane = [&](const Vec3& normal) {
    const Vec3 steps = turned_.map.transposed(normal);
    Distance d{dot(at, normal), reach_along(reach, normal), {}};
    for (std::size_t i = 0; i < 3; ++i) d.step[i] = 2.0 / 3 * region.reach[i] * steps[i];
    return d;
  };
  const std::array<Distance, 5> planes{from_plane(ahead_), from_plane(sides_[0].inward), from_plane(sides_[1].inward), from_plane(sides_[2].inward),
                                       from_plane(sides_[3].inward)};
  bool is_inside = true;  // the whole region
  for (const Distance& d : planes) {
    if (d.of_middle + 3 * d.reach < 0) return kLeast;
    is_inside &= d.of_middle - 3 * d.reach >= 0;
  }
  const double least_depth = least_depth_of(at, whole_reach), radius = length(reach);
  double sum = 0;
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        bool is_beside = false;
        if (!is_inside) {
          for (const Distance& d : planes) is_beside |= d.of_part(x, y, z) + d.reach < 0;
        }
        const double ratio = least_depth / std::max({planes[0].of_part(x, y, z), radius, least_depth});
        sum += is_beside ? 0 : ratio * ratio * ratio * ratio;
      }
    }
  }
  return std::clamp(sum / 27, kLeast, 1.0);
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
