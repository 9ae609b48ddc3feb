// Smooth normals of a surface of triangles: at each point the sum of the triangles' unit normals, weighted by their
// angles there.
//
// G. Thürmer and C. A. Wüthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools 3(1), 1998.
// Sums are whole numbers: they do not depend on the order of the triangles, and what a triangle added can be subtracted
// again exactly.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numbers>

#include "common/util/vec3.h"

namespace intervale {

// In steps of 2^-20; only its direction matters.
using NormalSum = std::array<std::int32_t, 3>;
inline constexpr double kNormalSteps = 1 << 20;

// The nearest whole number, of two the even one. value: within 2^31 of 0. Its bits follow a sum that has no bits below
// 1: one addition, where std::rint() and a conversion are several instructions.
[[nodiscard]] inline std::int32_t nearest_int(double value) {
  const double sum = value + 0x1.8p52;
  std::int64_t bits = 0;
  std::memcpy(&bits, &sum, sizeof bits);
  return std::int32_t(bits);
}

// What a triangle, counterclockwise seen from outside, adds at each of its corners; 0 if it has no area. Directions are
// those of the space of the corners: apply the grid's affine to samples first. arc_tangent: as std::atan2, of a y above
// 0. Its precision is the caller's choice, since it takes much of the time.
template <class ArcTangent>
[[nodiscard]] std::array<NormalSum, 3> angle_weighted_normals(const std::array<Vec3, 3>& corners, const ArcTangent& arc_tangent) {
  constexpr double kPi = std::numbers::pi;
  std::array<NormalSum, 3> added{};
  const Vec3 first = subtract(corners[1], corners[0]), second = subtract(corners[2], corners[1]), third = subtract(corners[0], corners[2]);
  const Vec3 normal = cross(first, second);
  const double twice_area = std::sqrt(dot(normal, normal));
  if (!(twice_area > 0)) return added;
  // Of two sides of a triangle, |cross product| and dot product are the sine and the cosine of their angle, times the
  // same number.
  const double a = arc_tangent(twice_area, -dot(third, first)), b = arc_tangent(twice_area, -dot(first, second));
  const std::array<double, 3> angle{a, b, kPi - a - b};
  const double steps = kNormalSteps / twice_area;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) added[k][i] = nearest_int(angle[k] * steps * normal[i]);
  }
  return added;
}

// To 1e-5 (Abramowitz and Stegun 4.4.47), several times faster than std::atan2. y: 0 or above; of two zeros, some finite
// number. Without branches, which would be as likely to go one way as the other.
template <class Real>
[[nodiscard]] inline Real quick_arc_tangent(Real y, Real x) {
  constexpr Real kHalf = std::numbers::pi_v<Real> / 2, kQuarter = kHalf / 2;
  const Real along = std::abs(x), t = std::min(y, along) / std::max(std::max(y, along), std::numeric_limits<Real>::min()), s = t * t;
  const Real part = t * (Real(0.9998660) + s * (Real(-0.3302995) + s * (Real(0.1801410) + s * (Real(-0.0851330) + s * Real(0.0208351)))));
  const Real angle = kQuarter - std::copysign(kQuarter - part, along - y);  // part, or what it lacks to a right angle
  return kHalf - std::copysign(kHalf - angle, x);                           // angle, or what it lacks to a straight one
}

}  // namespace intervale
