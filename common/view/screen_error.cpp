#include "common/view/screen_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace intervale {
namespace {

// Errors shrink to 1 / (1 + kFade) at a right angle to the edge of the picture, and beyond.
constexpr double kFade = 15;

// The 3 x 3 x 3 parts of a region, and one that counts nothing: their places, in steps from the middle.
constexpr std::size_t kParts = 28;
using Parts = std::array<double, kParts>;
constexpr Parts places_along(int axis) {
  Parts places{};
  for (std::size_t i = 0; i < 27; ++i) places[i] = double(int(axis == 0 ? i % 3 : axis == 1 ? i / 3 % 3 : i / 9) - 1);
  return places;
}
constexpr Parts kPartsX = places_along(0), kPartsY = places_along(1), kPartsZ = places_along(2);

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
    const double beyond = -dot(at, s.inward) - reach_along(reach, s.inward);
    if (beyond <= 0) continue;
    const double behind = -dot(at, s.edge) - reach_along(reach, s.edge);
    outside = std::max(outside, behind > 0 ? std::hypot(beyond, behind) : beyond);
  }
  if (outside == 0) return scale_ / depth;
  return scale_ / (depth * (1 + kFade * outside / std::sqrt(far2)));
}

ScreenError::Regions::Regions(const Grid& grid, std::span<const Region> regions) : blocks_((regions.size() + kBlock - 1) / kBlock) {
  const TurnedAffine turned(grid.affine);
  const Region box{{(grid.dims[0] - 1) / 2.0, (grid.dims[1] - 1) / 2.0, (grid.dims[2] - 1) / 2.0},
                   {(grid.dims[0] - 1) / 2.0, (grid.dims[1] - 1) / 2.0, (grid.dims[2] - 1) / 2.0}};
  middle_ = turned.map.point(box.middle);
  if (const double diagonal = length(turned.map.reach(box.reach)); diagonal > 0) unit_ = diagonal;
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const Vec3 from_middle = subtract(turned.map.point(regions[r].middle), middle_), reach = turned.map.reach(regions[r].reach);
    Block& block = blocks_[r / kBlock];
    for (std::size_t i = 0; i < 3; ++i) {
      block.middle[i][r % kBlock] = float(from_middle[i] / unit_);
      block.reach[i][r % kBlock] = float(reach[i] / unit_);
    }
  }
}

// As pixels_per_unit() and least_depth_of(), but for the distance behind a side of the picture, which may be greater.
ScreenError::Bounds ScreenError::bounds(const Regions& regions, std::size_t block) const {
  const Regions::Block& b = regions.blocks_[block];
  constexpr std::size_t kBlock = Regions::kBlock;
  using Floats = std::array<float, kBlock>;
  const auto in_units = [&regions](double distance) { return float(std::clamp(distance / regions.unit_, -1e18, 1e18)); };
  std::array<float, 3> eye{};
  for (std::size_t i = 0; i < 3; ++i) eye[i] = in_units(eye_[i] - regions.middle_[i]);
  const float rounding = 4e-6F * (1 + std::abs(eye[0]) + std::abs(eye[1]) + std::abs(eye[2]));  // of distances, at most
  // How far a block lies along a direction at least (sign 1) or at most (sign -1).
  const auto along = [&](const Vec3& direction, float sign) {
    std::array<float, 3> n{}, r{};
    for (std::size_t i = 0; i < 3; ++i) {
      n[i] = sign * float(direction[i]);
      r[i] = std::abs(n[i]);
    }
    Floats distance{};
    for (std::size_t k = 0; k < kBlock; ++k) {
      distance[k] = (b.middle[0][k] - eye[0]) * n[0] + (b.middle[1][k] - eye[1]) * n[1] + (b.middle[2][k] - eye[2]) * n[2] -
                    (b.reach[0][k] * r[0] + b.reach[1][k] * r[1] + b.reach[2][k] * r[2]) - rounding;
    }
    return distance;
  };
  Floats gap2{}, far2{}, outside{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < kBlock; ++k) {
      const float at = std::abs(b.middle[i][k] - eye[i]), gap = std::max(0.0F, at - b.reach[i][k] - rounding);
      gap2[k] += gap * gap;
      far2[k] += (at + b.reach[i][k]) * (at + b.reach[i][k]);
    }
  }
  for (const Side& s : sides_) {
    const Floats beyond = along(s.inward, -1);
    for (std::size_t k = 0; k < kBlock; ++k) outside[k] = std::max(outside[k], beyond[k]);
  }
  const Floats ahead = along(ahead_, 1), behind = along(ahead_, -1);
  const float least_depth = in_units(least_depth_), cos_corner = float(cos_corner_);
  const double scale_in_units = scale_ / regions.unit_ * (1 + 1e-5);
  const float scale = scale_in_units < 0x1p126 ? float(scale_in_units) : std::numeric_limits<float>::infinity();
  Bounds bounds;
  for (std::size_t k = 0; k < kBlock; ++k) {
    const float depth = std::max({ahead[k], std::sqrt(gap2[k]) * cos_corner, least_depth});
    const float faded = 1 + float(kFade) * outside[k] / (std::sqrt(far2[k]) + rounding);
    bounds.pixels[k] = std::min(scale / (depth * faded), 0x1p100F);
    bounds.share[k] = outside[k] > 0 || behind[k] > 0 ? 1e-6F : 1;
  }
  return bounds;
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
  const double least_depth = least_depth_of(at, whole_reach);
  // Distances of the parts from a plane through the eye.
  const auto parts_from = [&](const Vec3& normal, double of_middle) {
    const Vec3 steps = turned_.map.transposed(normal);  // from a part to the next, along each axis of the samples
    Vec3 d{};
    for (std::size_t i = 0; i < 3; ++i) d[i] = 2.0 / 3 * region.reach[i] * steps[i];
    Parts parts;
    for (std::size_t i = 0; i < kParts; ++i) parts[i] = of_middle + kPartsX[i] * d[0] + kPartsY[i] * d[1] + kPartsZ[i] * d[2];
    return parts;
  };
  const double ahead = dot(at, ahead_);
  if (ahead + reach_along(whole_reach, ahead_) < 0) return kLeast;
  Parts share = parts_from(ahead_, ahead);
  const double behind = -reach_along(reach, ahead_), least = std::max(length(reach), least_depth);
  for (std::size_t i = 0; i < kParts; ++i) {
    const double ratio = (share[i] < behind ? 0 : least_depth) / std::max(share[i], least);
    share[i] = ratio * ratio * ratio * ratio;
  }
  for (const Side& s : sides_) {
    const double middle = dot(at, s.inward), whole = reach_along(whole_reach, s.inward);
    if (middle + whole < 0) return kLeast;
    if (middle - whole >= 0) continue;  // nothing is beside it
    const Parts inside = parts_from(s.inward, middle);
    const double beside = -whole / 3;
    for (std::size_t i = 0; i < kParts; ++i) share[i] = inside[i] < beside ? 0 : share[i];
  }
  std::array<double, 4> sums{};
  share[27] = 0;
  for (std::size_t i = 0; i < kParts; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) sums[k] += share[i + k];
  }
  return std::clamp((sums[0] + sums[1] + sums[2] + sums[3]) / 27, kLeast, 1.0);
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
