#include "client/core/camera_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/util/vec3.h"

namespace intervale {
namespace {

using namespace std::chrono_literals;
using MotionTime = CameraMotion::Time;

constexpr MotionTime kMotionStart{1000ms};

Camera camera_turned(double radians) { return {.eye = {10, 0, 0}, .look_at = {10 - 5 * std::cos(radians), 0, 5 * std::sin(radians)}}; }

double angle_between(const Camera& a, const Camera& b) {
  const Vec3 to_a = subtract(a.look_at, a.eye), to_b = subtract(b.look_at, b.eye);
  return std::atan2(length(cross(to_a, to_b)), dot(to_a, to_b));
}

TEST(CameraMotion, GoesOnAsFastAsItWent) {
  CameraMotion motion;
  EXPECT_FALSE(motion.next(camera_turned(0), kMotionStart)) << "it is not known yet";
  const auto ahead = motion.next(camera_turned(0.01), kMotionStart + 50ms);
  ASSERT_TRUE(ahead);
  EXPECT_EQ(ahead->until, kMotionStart + 50ms + CameraMotion::kTime);
  EXPECT_NEAR(angle_between(camera_turned(0.01), ahead->camera), 0.05, 1e-3);
  EXPECT_NEAR(angle_between(camera_turned(0), ahead->camera), 0.06, 1e-3);
  const auto slower = motion.next(camera_turned(0.015), kMotionStart + 150ms);
  ASSERT_TRUE(slower);
  EXPECT_NEAR(angle_between(camera_turned(0.015), slower->camera), 0.0125, 1e-3);
}

TEST(CameraMotion, GoesStraightOn) {
  CameraMotion motion;
  Camera camera{.eye = {0, 0, 100}, .look_at = {0, 0, 0}};
  EXPECT_FALSE(motion.next(camera, kMotionStart));
  camera.eye[0] = camera.look_at[0] = 2;
  const auto ahead = motion.next(camera, kMotionStart + 100ms);
  ASSERT_TRUE(ahead);
  camera.eye[0] = camera.look_at[0] = 7;
  EXPECT_EQ(ahead->camera, camera);
}

TEST(CameraMotion, IsNotSeenWhereACameraRestsOrJumps) {
  CameraMotion motion;
  EXPECT_FALSE(motion.next(camera_turned(0), kMotionStart));
  EXPECT_FALSE(motion.next(camera_turned(0), kMotionStart + 10ms)) << "it stands still";
  EXPECT_FALSE(motion.next(camera_turned(0.1), kMotionStart + 11ms + CameraMotion::kTime)) << "it has rested";
  EXPECT_FALSE(motion.next(camera_turned(0.2), kMotionStart + 11ms + CameraMotion::kTime)) << "no time has passed";
  MotionTime now = kMotionStart + 300ms;
  EXPECT_FALSE(motion.next(camera_turned(1), now += 10ms)) << "a jump";
  Camera wider = camera_turned(1.01);
  wider.fov = 60;
  EXPECT_FALSE(motion.next(wider, now += 10ms)) << "another camera";
  wider.look_at[1] = 0.01;
  EXPECT_TRUE(motion.next(wider, now += 10ms));
}

TEST(CameraMotion, IsBounded) {
  CameraMotion motion;
  EXPECT_FALSE(motion.next(camera_turned(0), kMotionStart));
  const auto ahead = motion.next(camera_turned(0.2), kMotionStart + 1ms);
  ASSERT_TRUE(ahead);
  EXPECT_LE(angle_between(camera_turned(0.2), ahead->camera), 1.1 * CameraMotion::kMostTurn);
}

TEST(CameraMotion, GivesOnlyCamerasThatAreValid) {
  const double large = std::numeric_limits<double>::max(), small = std::numeric_limits<double>::denorm_min();
  for (const double a : {0.0, small, 1.0, 1.1, large / 2, large}) {
    for (const double b : {small, 1.0, 1.2, large / 2, large}) {
      CameraMotion motion;
      Camera camera{.eye = {0, a, 0}, .look_at = {b, 0, 0}, .up = {0, 0, 1}};
      (void)motion.next(camera, kMotionStart);
      camera.eye[1] = b;
      const auto ahead = motion.next(camera, kMotionStart + 1ms);
      Lod lod;
      if (ahead) lod.camera = ahead->camera;
      EXPECT_TRUE(check_lod(lod)) << a << ' ' << b;
    }
  }
}

}  // namespace
}  // namespace intervale
