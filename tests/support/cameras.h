// Random cameras and levels of detail, and what a pinhole camera shows, by its own arithmetic.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "common/diamond/grid.h"
#include "common/view/lod.h"

namespace intervale::testing {

using Vector = std::array<double, 3>;

inline double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vector cross(const Vector& a, const Vector& b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
inline Vector along(const Vector& from, double length, const Vector& direction) {
  return {from[0] + length * direction[0], from[1] + length * direction[1], from[2] + length * direction[2]};
}
inline double length(const Vector& v) { return std::sqrt(dot(v, v)); }
inline Vector unit(const Vector& v) { return along({}, 1 / length(v), v); }

inline double uniform(std::mt19937& random, double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

inline Vector random_direction(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return unit({normal(random), normal(random), normal(random)});
}

// In, beside or far from the box; it looks at a point in it, or somewhere else.
inline Camera random_camera(const Grid& g, std::mt19937& random) {
  Camera camera;
  const double away = std::pow(10.0, uniform(random, -0.5, 1));
  for (int i = 0; i < 3; ++i) {
    const double side = g.affine.spacing()[i] * (g.dims[i] - 1), middle = g.affine.origin()[i] + side / 2;
    camera.eye[i] = middle + away * side * uniform(random, -1, 1);
    camera.look_at[i] = middle + (random() % 4 == 0 ? 5 : 0.5) * side * uniform(random, -1, 1);
  }
  const Vector ahead = unit(minus(camera.look_at, camera.eye));
  do camera.up = random_direction(random);
  while (length(cross(ahead, camera.up)) < 0.1);
  camera.up = along({}, uniform(random, 0.1, 10), camera.up);
  camera.fov = random() % 8 == 0 ? uniform(random, 100, 170) : uniform(random, 2, 100);
  camera.viewport = {int(100 + random() % 2000), int(100 + random() % 2000)};
  return camera;
}

// Perhaps an error, a region, and a camera, each by itself.
inline Lod random_lod(const Grid& g, std::mt19937& random) {
  Lod lod;
  if (random() % 2 == 0) lod.error_percent = double(random() % 40);
  if (random() % 3 == 0) {
    lod.roi.emplace();
    for (int i = 0; i < 3; ++i) {
      lod.roi->min[i] = g.affine.origin()[i] + g.affine.spacing()[i] * uniform(random, -1, g.dims[i]);
      lod.roi->max[i] = lod.roi->min[i] + g.affine.spacing()[i] * uniform(random, 0, 8);
    }
  }
  if (random() % 3 != 0) {
    lod.camera = random_camera(g, random);
    lod.camera->pixel_error = std::pow(2.0, uniform(random, -1, 8));
  }
  return lod;
}

class NaiveCamera {
 public:
  explicit NaiveCamera(const Camera& c)
      : eye_(c.eye),
        ahead_(unit(minus(c.look_at, c.eye))),
        right_(unit(cross(ahead_, c.up))),
        up_(cross(right_, ahead_)),
        width_(c.viewport[0]),
        height_(c.viewport[1]),
        scale_(height_ / (2 * std::tan(c.fov * std::numbers::pi / 360))) {}

  [[nodiscard]] const Vector& ahead() const { return ahead_; }
  [[nodiscard]] const Vector& right() const { return right_; }
  [[nodiscard]] const Vector& up() const { return up_; }
  [[nodiscard]] double half_width() const { return std::atan(width_ / 2 / scale_); }  // as angles
  [[nodiscard]] double half_height() const { return std::atan(height_ / 2 / scale_); }
  [[nodiscard]] double slant() const { return std::hypot(1.0, width_ / 2 / scale_, height_ / 2 / scale_); }  // 1 / cosine, in the corners
  [[nodiscard]] double depth(const Vector& p) const { return dot(minus(p, eye_), ahead_); }

  // In pixels from the picture's middle.
  [[nodiscard]] std::array<double, 2> project(const Vector& p) const {
    const Vector d = minus(p, eye_);
    return {scale_ * dot(d, right_) / depth(p), scale_ * dot(d, up_) / depth(p)};
  }
  [[nodiscard]] bool shows(const Vector& p) const {
    if (!(depth(p) > 0)) return false;
    const auto [x, y] = project(p);
    return std::abs(x) <= width_ / 2 && std::abs(y) <= height_ / 2;
  }
  // Of what lies across the line of sight there.
  [[nodiscard]] double pixels_per_unit(const Vector& p) const { return scale_ / depth(p); }
  [[nodiscard]] double pixels_between(const Vector& p, const Vector& q) const {
    const auto a = project(p), b = project(q);
    return std::hypot(a[0] - b[0], a[1] - b[1]);
  }

 private:
  Vector eye_, ahead_, right_, up_;
  double width_, height_, scale_;
};

}  // namespace intervale::testing
