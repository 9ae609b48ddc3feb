#include "client/core/camera_motion.h"

#include <algorithm>
#include <utility>

#include "common/util/vec3.h"

namespace intervale {
namespace {

// Both by so many steps more.
Camera straight_on(const Camera& before, const Camera& now, double steps) {
  Camera camera = now;
  camera.eye = lerp(before.eye, now.eye, 1 + steps);
  camera.look_at = lerp(before.look_at, now.look_at, 1 + steps);
  return camera;
}

// How far they differ, against the most that is allowed.
double share_of_most(const Camera& a, const Camera& b) {
  const Vec3 to_a = subtract(a.look_at, a.eye), to_b = subtract(b.look_at, b.eye);
  const double turn = std::atan2(length(cross(to_a, to_b)), dot(to_a, to_b)), shift = length(subtract(b.eye, a.eye)) / length(to_a);
  return std::max(turn / CameraMotion::kMostTurn, shift / CameraMotion::kMostShift);
}

}  // namespace

std::optional<CameraAhead> CameraMotion::next(const Camera& camera, Time now) {
  const auto last = std::exchange(last_, Seen{camera, now});
  if (!last || now <= last->at || now - last->at > kTime) return {};
  Camera same = last->camera;
  same.eye = camera.eye;
  same.look_at = camera.look_at;
  same.up = camera.up;
  const double step = share_of_most(last->camera, camera);
  if (same != camera || !(step > 0) || !(step <= 1)) return {};
  const double steps = std::min(std::chrono::duration<double>(kTime) / (now - last->at), 1 / step);
  CameraAhead ahead{straight_on(last->camera, camera, steps), now + kTime};
  // Numbers that are very large or small, and an eye that runs into the point
  const bool is_sane = check_lod({.error = 0, .error_percent = {}, .roi = {}, .camera = ahead.camera, .max_tets = {}, .max_updates = {}}).has_value();
  if (!is_sane || !(share_of_most(camera, ahead.camera) <= 2)) return {};
  return ahead;
}

}  // namespace intervale
