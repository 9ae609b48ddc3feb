#include "client/load/camera_paths.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "common/util/vec3.h"

namespace intervale {
namespace {

constexpr double kTurnSeconds = 20;
constexpr double kZoomSeconds = 10;    // there and back
constexpr double kNearest = 0.05;      // least distance from a point looked at, in radii of the box
constexpr double kSteepest = 1.0;      // greatest elevation of an orbit, in radians
constexpr double kMargin = 1.05;       // around a box that is in the picture as a whole
constexpr std::uint64_t kPerView = 8;  // random numbers that a view may take

// Centre and radius of the sphere around the box.
struct Ball {
  Vec3 centre{};
  double radius = 0;
  explicit Ball(const Box& box) {
    for (std::size_t i = 0; i < 3; ++i) centre[i] = (box.min[i] + box.max[i]) / 2;
    radius = std::hypot(box.max[0] - box.min[0], box.max[1] - box.min[1], box.max[2] - box.min[2]) / 2;
  }
};

// The distance from the centre of a ball of radius 1 at which the camera sees all of it, in width and in height.
double distance_to_see_all(const Camera& camera) {
  const double up = camera.fov * std::numbers::pi / 360;  // half of the angle of view
  const double aside = std::atan(std::tan(up) * camera.viewport[0] / camera.viewport[1]);
  return kMargin / std::sin(std::min(up, aside));
}

// A direction, spread evenly over the sphere for height and turn in [0, 1].
Vec3 direction_of(double height, double turn) {
  const double y = 2 * height - 1;
  const double angle = 2 * std::numbers::pi * turn;
  const double across = std::sqrt(std::max(0.0, 1 - y * y));
  return {across * std::cos(angle), y, across * std::sin(angle)};
}

void look(Camera& camera, const Vec3& at, const Vec3& from, double distance) {
  camera.look_at = at;
  for (std::size_t i = 0; i < 3; ++i) camera.eye[i] = at[i] + distance * from[i];
  // Any direction that is not close to the line of sight works: the vertical one if possible.
  camera.up = std::abs(from[1]) < 0.9 ? Vec3{0, 1, 0} : Vec3{0, 0, 1};
}

void orbit(Camera& camera, const CameraPath& path, const Ball& ball, double seconds) {
  const double tilt = kSteepest * (2 * random_fraction(path.seed, 0) - 1);
  const double angle = 2 * std::numbers::pi * (random_fraction(path.seed, 1) + seconds / kTurnSeconds);
  const Vec3 from{std::cos(tilt) * std::cos(angle), std::sin(tilt), std::cos(tilt) * std::sin(angle)};
  look(camera, ball.centre, from, ball.radius * distance_to_see_all(camera));
}

void zoom(Camera& camera, const CameraPath& path, const Ball& ball, double seconds) {
  // A point on one of the six sides, approached from outside. The distance shrinks by equal ratios, so that each step
  // changes the picture equally.
  Vec3 point{};
  for (std::size_t i = 0; i < 3; ++i) point[i] = std::lerp(path.box.min[i], path.box.max[i], random_fraction(path.seed, i));
  const auto side = std::size_t(6 * random_fraction(path.seed, 3));
  point[side / 2] = side % 2 == 0 ? path.box.min[side / 2] : path.box.max[side / 2];
  Vec3 from{};
  for (std::size_t i = 0; i < 3; ++i) from[i] = (point[i] - ball.centre[i]) / ball.radius;
  if (from == Vec3{}) from[side / 2] = 1;  // the middle of a box without thickness
  from = normalized(from);
  const double closeness = (1 - std::cos(2 * std::numbers::pi * seconds / kZoomSeconds)) / 2;
  look(camera, point, from, ball.radius * std::pow(distance_to_see_all(camera), 1 - closeness) * std::pow(kNearest, closeness));
}

void jump(Camera& camera, const CameraPath& path, const Ball& ball, std::uint64_t number) {
  const auto random = [&](std::uint64_t i) { return random_fraction(path.seed, number * kPerView + i); };
  Vec3 at{};
  for (std::size_t i = 0; i < 3; ++i) at[i] = std::lerp(path.box.min[i], path.box.max[i], random(i));
  const double closeness = random(3);
  look(camera, at, direction_of(random(4), random(5)),
       ball.radius * std::pow(distance_to_see_all(camera), 1 - closeness) * std::pow(kNearest, closeness));
}

}  // namespace

// Sebastiano Vigna, splitmix64. Good enough for angles, and the same on every platform, unlike std distributions.
double random_fraction(std::uint64_t seed, std::uint64_t number) {
  std::uint64_t x = seed * 0xd1342543de82ef95u + (number + 1) * 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return double((x ^ x >> 31) >> 11) * 0x1p-53;
}

Lod view_of(const CameraPath& path, std::uint64_t number) {
  if (path.scenario == Scenario::full) return {};
  const Ball ball(path.box);
  const double seconds = double(number) / path.views_per_second;
  Camera camera;
  camera.viewport = path.viewport;
  camera.pixel_error = path.pixel_error;
  if (path.scenario == Scenario::orbit) orbit(camera, path, ball, seconds);
  if (path.scenario == Scenario::zoom) zoom(camera, path, ball, seconds);
  if (path.scenario == Scenario::jump) jump(camera, path, ball, number);
  if (path.scenario == Scenario::range) orbit(camera, path, ball, 0);
  Lod lod;
  lod.camera = camera;
  return lod;
}

}  // namespace intervale
