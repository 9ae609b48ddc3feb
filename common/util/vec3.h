// Vectors of three numbers: points, directions and, with integers, offsets on a grid.
#pragma once

#include <array>
#include <cmath>

namespace intervale {

using Vec3 = std::array<double, 3>;

template <class T>
[[nodiscard]] constexpr std::array<T, 3> subtract(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

template <class T>
[[nodiscard]] constexpr T dot(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
[[nodiscard]] constexpr std::array<T, 3> cross(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Six times the volume of the tetrahedron with edges a, b and c from one corner; positive if they are right-handed.
template <class T>
[[nodiscard]] constexpr T triple_product(const std::array<T, 3>& a, const std::array<T, 3>& b, const std::array<T, 3>& c) {
  return dot(cross(a, b), c);
}

[[nodiscard]] constexpr Vec3 scaled(double s, const Vec3& v) { return {s * v[0], s * v[1], s * v[2]}; }

// a for t = 0; t = 1 gives b up to rounding.
[[nodiscard]] constexpr Vec3 lerp(const Vec3& a, const Vec3& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

// Does not overflow where its square would.
[[nodiscard]] inline double length(const Vec3& v) { return std::hypot(v[0], v[1], v[2]); }

// The vector of length 1 in the direction of v; 0 for 0.
[[nodiscard]] inline Vec3 normalized(const Vec3& v) {
  const double l = length(v);
  return l > 0 ? Vec3{v[0] / l, v[1] / l, v[2] / l} : Vec3{};
}

[[nodiscard]] inline bool is_finite(const Vec3& v) { return std::isfinite(v[0]) && std::isfinite(v[1]) && std::isfinite(v[2]); }

}  // namespace intervale
