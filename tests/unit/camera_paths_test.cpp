// Laws of the cameras that a load looks through.
#include "client/load/camera_paths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::cross, testing::dot, testing::length, testing::minus, testing::unit, testing::Vector;

CameraPath path_of(Scenario scenario, std::uint64_t seed) {
  CameraPath path;
  path.scenario = scenario;
  path.box = {{-4, 0, 7}, {6, 3, 7.5}};
  path.seed = seed;
  return path;
}

Camera camera(const CameraPath& path, std::uint64_t number) { return view_of(path, number).camera.value(); }

Vector centre_of(const Box& box) { return {(box.min[0] + box.max[0]) / 2, (box.min[1] + box.max[1]) / 2, (box.min[2] + box.max[2]) / 2}; }

bool sees(const Camera& c, const Vector& point) {
  const Vector ahead = unit(minus(c.look_at, c.eye));
  const Vector right = unit(cross(ahead, c.up));
  const Vector up = cross(right, ahead);
  const Vector to = minus(point, c.eye);
  const double high = std::tan(c.fov * std::numbers::pi / 360);
  const double wide = high * c.viewport[0] / c.viewport[1];
  const double depth = dot(to, ahead);
  return depth > 0 && std::abs(dot(to, up)) <= high * depth && std::abs(dot(to, right)) <= wide * depth;
}

bool sees_all(const Camera& c, const Box& box) {
  for (int corner = 0; corner < 8; ++corner) {
    if (!sees(c, {corner & 1 ? box.max[0] : box.min[0], corner & 2 ? box.max[1] : box.min[1], corner & 4 ? box.max[2] : box.min[2]})) return false;
  }
  return true;
}

TEST(CameraPaths, FullIsEverythingAtOnce) {
  for (std::uint64_t number : {0, 1, 100}) EXPECT_EQ(view_of(path_of(Scenario::full, 3), number), Lod{});
}

class Paths : public ::testing::TestWithParam<Scenario> {};

TEST_P(Paths, EveryViewIsALevelOfDetail) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    CameraPath path = path_of(GetParam(), seed);
    path.pixel_error = 0.5;
    path.viewport = {300, 800};
    if (seed % 3 == 0) path.box.max[1] = path.box.min[1];  // without thickness
    for (std::uint64_t number = 0; number < 200; ++number) {
      const Lod view = view_of(path, number);
      ASSERT_TRUE(check_lod(view)) << "seed " << seed << ", view " << number;
      EXPECT_EQ(view.error, 0);
      EXPECT_EQ(view.camera->pixel_error, 0.5);
      EXPECT_EQ(view.camera->viewport, path.viewport);
    }
  }
}

TEST_P(Paths, ViewsDependOnSeedAndNumberOnly) {
  const CameraPath path = path_of(GetParam(), 5);
  std::set<Vector> starts;
  for (std::uint64_t seed = 0; seed < 50; ++seed) starts.insert(camera(path_of(GetParam(), seed), 0).eye);
  EXPECT_EQ(starts.size(), 50u);
  for (std::uint64_t number = 0; number < 20; ++number) {
    EXPECT_EQ(view_of(path, number), view_of(path, number));
    EXPECT_NE(view_of(path, number), view_of(path, number + 1));
  }
}

INSTANTIATE_TEST_SUITE_P(CameraPaths, Paths, ::testing::Values(Scenario::orbit, Scenario::zoom, Scenario::jump));

TEST(CameraPaths, WhileTheRangeIsDraggedTheCameraStaysWhereAnOrbitBegins) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (std::uint64_t number : {0, 1, 100}) EXPECT_EQ(view_of(path_of(Scenario::range, seed), number), view_of(path_of(Scenario::orbit, seed), 0));
  }
}

TEST(CameraPaths, AnOrbitSeesTheWholeBoxAndTurnsIn20Seconds) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    CameraPath path = path_of(Scenario::orbit, seed);
    if (seed % 2 == 1) path.viewport = {600, 1000};
    const Vector middle = centre_of(path.box);
    for (std::uint64_t number = 0; number < 100; ++number) {
      const Camera c = camera(path, number);
      ASSERT_TRUE(sees_all(c, path.box)) << "seed " << seed << ", view " << number;
      EXPECT_EQ(c.look_at, middle);
      EXPECT_NEAR(length(minus(c.eye, middle)), length(minus(camera(path, 0).eye, middle)), 1e-9);
      EXPECT_NEAR(length(minus(c.eye, camera(path, number + 100).eye)), 0, 1e-9);  // 5 views a second, 20 s
    }
    const Vector half = camera(path, 50).eye;
    EXPECT_NEAR(half[0] - middle[0], middle[0] - camera(path, 0).eye[0], 1e-9);
    EXPECT_NEAR(half[2] - middle[2], middle[2] - camera(path, 0).eye[2], 1e-9);
  }
}

TEST(CameraPaths, AZoomGoesFromAllOfTheBoxToOnePointOfIt) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const CameraPath path = path_of(Scenario::zoom, seed);
    const double radius = length(minus(path.box.max, path.box.min)) / 2;
    const Camera far = camera(path, 0), near = camera(path, 25);
    const auto distance = [](const Camera& c) { return length(minus(c.eye, c.look_at)); };
    EXPECT_TRUE(sees_all(far, path.box)) << "seed " << seed;
    EXPECT_EQ(far.look_at, near.look_at);
    EXPECT_NEAR(distance(near), radius / 20, 1e-9);
    bool on_a_side = false;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GE(far.look_at[i], path.box.min[i]);
      EXPECT_LE(far.look_at[i], path.box.max[i]);
      on_a_side = on_a_side || far.look_at[i] == path.box.min[i] || far.look_at[i] == path.box.max[i];
    }
    EXPECT_TRUE(on_a_side);
    for (std::uint64_t number = 0; number < 25; ++number) {
      EXPECT_GT(distance(camera(path, number)), distance(camera(path, number + 1)));
      EXPECT_LT(distance(camera(path, 25 + number)), distance(camera(path, 26 + number)));
    }
  }
}

TEST(CameraPaths, BoxesSpanTheSamples) {
  const Box box = box_of({.dims = {3, 11, 2}, .affine = Affine::of({0.5, 1, 4}, {-1, 0, 2})});
  EXPECT_EQ(box, (Box{{-1, 0, 2}, {0, 10, 6}}));
}

TEST(CameraPaths, RandomFractionsSpreadEvenly) {
  std::array<int, 10> tenths{};
  for (std::uint64_t number = 0; number < 10000; ++number) {
    const double x = random_fraction(number / 100, number % 100);
    ASSERT_GE(x, 0);
    ASSERT_LT(x, 1);
    ++tenths[std::size_t(10 * x)];
  }
  for (int count : tenths) EXPECT_NEAR(count, 1000, 150);
}

}  // namespace
}  // namespace intervale
