#include "common/picture/viewpoint.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace intervale {
namespace {

constexpr Vec3 kThreeQuarter{0.62, -1, 0.52};  // towards the eye, as in the viewer
constexpr std::array<int, 2> kPixels{1280, 960};
constexpr double kFov = 30;
constexpr double kMargin = 1.04;    // around the box
constexpr double kNearest = 0.002;  // ahead of an eye that is inside, in the scene

Vec3 middle_of(const Box& box) {
  Vec3 middle;  // of both, also where their sum would overflow
  for (std::size_t i = 0; i < 3; ++i) middle[i] = box.min[i] + (box.max[i] - box.min[i]) / 2;
  return middle;
}

Axes axes_of(const Vec3& back, const Vec3& up) {
  const Vec3 b = normalized(back), right = normalized(cross(normalized(up), b));
  return {right, cross(b, right), b};
}

}  // namespace

Axes axes_of(const Camera& camera) { return axes_of(subtract(camera.eye, camera.look_at), camera.up); }

Camera three_quarter_view(const Box& box, const std::optional<Plane>& clip) {
  Camera camera;
  camera.fov = kFov;
  camera.viewport = kPixels;
  camera.look_at = middle_of(box);
  camera.up = {0, 0, 1};
  Vec3 from = kThreeQuarter;
  for (std::size_t i = 0; clip && i < 3; ++i) {
    if (clip->normal[i] != 0) from[i] = std::copysign(from[i], clip->normal[i]);
  }
  const Axes axes = axes_of(from, camera.up);
  const double tan_y = std::tan(camera.fov * std::numbers::pi / 360), tan_x = tan_y * camera.viewport[0] / camera.viewport[1];
  double distance = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = (corner >> i & 1) != 0 ? box.max[i] : box.min[i];
    p = subtract(p, camera.look_at);
    const double aside = std::max(std::abs(dot(p, axes.right)) / tan_x, std::abs(dot(p, axes.up)) / tan_y);
    distance = std::max(distance, dot(p, axes.back) + kMargin * aside);
  }
  for (std::size_t i = 0; i < 3; ++i) camera.eye[i] = camera.look_at[i] + distance * axes.back[i];
  return camera;
}

Viewpoint::Viewpoint(const Camera& camera, const Box& box) : centre(middle_of(box)) {
  unit = length(subtract(box.max, box.min)) / 2;
  const Vec3 from = scaled(1 / unit, subtract(camera.eye, centre));
  const Axes axes = axes_of(camera);
  const double ahead = dot(from, axes.back);  // of the eye to the middle, along the line of sight
  const double nearest = std::max(kNearest, (ahead - 1) * 0.999), far = std::max(2 * nearest, (ahead + 1) * 1.001);
  const double scale_y = 1 / std::tan(camera.fov * std::numbers::pi / 360), scale_x = scale_y * camera.viewport[1] / camera.viewport[0];
  const double a = (far + nearest) / (nearest - far), b = 2 * far * nearest / (nearest - far);

  // Computed in doubles: seen from afar, depths differ by the small remainder of large numbers that nearly cancel.
  const std::array<Vec3, 3> rows{axes.right, axes.up, axes.back};
  std::array<double, 3> shift;
  for (std::size_t i = 0; i < 3; ++i) shift[i] = -dot(rows[i], from);
  for (std::size_t column = 0; column < 4; ++column) {
    const auto of = [&](std::size_t row) { return column < 3 ? rows[row][column] : shift[row]; };
    for (std::size_t row = 0; row < 3 && column < 3; ++row) rotation[3 * column + row] = float(of(row));
    projection[4 * column] = float(scale_x * of(0));
    projection[4 * column + 1] = float(scale_y * of(1));
    projection[4 * column + 2] = float(a * of(2) + (column == 3 ? b : 0));
    projection[4 * column + 3] = float(-of(2));
  }
  for (std::size_t i = 0; i < 3; ++i) eye[i] = float(from[i]);
  nearest_to_far = {float(nearest), float(far)};
}

std::array<float, 3> Viewpoint::in_scene(const std::array<double, 3>& world) const {
  return {float((world[0] - centre[0]) / unit), float((world[1] - centre[1]) / unit), float((world[2] - centre[2]) / unit)};
}

}  // namespace intervale
