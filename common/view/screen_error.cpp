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

ScreenError::RegionBounds::RegionBounds(const ScreenError& screen, const Regions& regions) : regions_(regions) {
  const auto in_units = [&regions](double distance) { return float(std::clamp(distance / regions.unit_, -1e18, 1e18)); };
  const auto normal = [](const Vec3& n) {
    Normal in_floats;
    for (std::size_t i = 0; i < 3; ++i) {
      in_floats.of[i] = float(n[i]);
      in_floats.size[i] = std::abs(in_floats.of[i]);
    }
    return in_floats;
  };
  for (std::size_t i = 0; i < 3; ++i) eye_[i] = in_units(screen.eye_[i] - regions.middle_[i]);
  rounding_ = 4e-6F * (1 + std::abs(eye_[0]) + std::abs(eye_[1]) + std::abs(eye_[2]));
  ahead_ = normal(screen.ahead_);
  for (std::size_t i = 0; i < inward_.size(); ++i) inward_[i] = normal(screen.sides_[i].inward);
  least_depth_ = in_units(screen.least_depth_);
  cos_corner_ = float(screen.cos_corner_);
  const double scale = screen.scale_ / regions.unit_ * (1 + 1e-5);
  scale_ = scale < 0x1p126 ? float(scale) : std::numeric_limits<float>::infinity();
}

// As pixels_per_unit() and least_depth_of(), but for the distance behind a side of the picture, which may be greater.
// Written so that the compiler looks at several regions in one step: no branches, and all that the loop reads but the
// block is local.
inline ScreenError::Bounds ScreenError::RegionBounds::bounds_of(const Regions::Block& block) const {
  const auto larger = [](float a, float b) { return a < b ? b : a; };
  const Floats3 eye = eye_;
  const Normal ahead = ahead_;
  const std::array<Normal, 4> inward = inward_;
  const float rounding = rounding_, least_depth = least_depth_, cos_corner = cos_corner_, scale = scale_;
  Bounds bounds;
  for (std::size_t k = 0; k < Regions::kBlock; ++k) {
    const float x = block.middle[0][k] - eye[0], y = block.middle[1][k] - eye[1], z = block.middle[2][k] - eye[2];
    const float reach_x = block.reach[0][k], reach_y = block.reach[1][k], reach_z = block.reach[2][k];
    const float far_x = std::abs(x) + reach_x, far_y = std::abs(y) + reach_y, far_z = std::abs(z) + reach_z;
    const float gap_x = larger(0, std::abs(x) - reach_x - rounding), gap_y = larger(0, std::abs(y) - reach_y - rounding),
                gap_z = larger(0, std::abs(z) - reach_z - rounding);
    const auto along = [&](const Normal& n) { return x * n.of[0] + y * n.of[1] + z * n.of[2]; };
    const auto reach_along = [&](const Normal& n) { return reach_x * n.size[0] + reach_y * n.size[1] + reach_z * n.size[2] + rounding; };
    const auto beyond = [&](const Normal& n) { return -along(n) - reach_along(n); };
    const float outside = larger(larger(larger(beyond(inward[0]), beyond(inward[1])), larger(beyond(inward[2]), beyond(inward[3]))), 0);
    const float middle = along(ahead), reach = reach_along(ahead);
    const float gap = std::sqrt(gap_x * gap_x + gap_y * gap_y + gap_z * gap_z);
    const float depth = larger(larger(middle - reach, gap * cos_corner), least_depth);
    const float faded = 1 + float(kFade) * outside / (std::sqrt(far_x * far_x + far_y * far_y + far_z * far_z) + rounding);
    const float pixels = scale / (depth * faded);
    bounds.pixels[k] = pixels < 0x1p100F ? pixels : 0x1p100F;
    bounds.share[k] = larger(outside, -middle - reach) > 0 ? 1e-6F : 1;  // beside the picture, or behind
  }
  return bounds;
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] ScreenError::Bounds ScreenError::RegionBounds::bounds_of_avx2(const Regions::Block& block) const { return bounds_of(block); }
#endif

ScreenError::Bounds ScreenError::RegionBounds::operator()(std::size_t block) const {
#if defined(__x86_64__)
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2") != 0;
  if (kHasAvx2) return bounds_of_avx2(regions_.blocks_[block]);
#endif
  return bounds_of(regions_.blocks_[block]);
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
