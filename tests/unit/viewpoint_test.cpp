#include "common/picture/viewpoint.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::dot;
using testing::minus;
using testing::NaiveCamera;
using testing::uniform;
using testing::Vector;

Vector corner_of(const Box& box, unsigned corner) {
  Vector p;
  for (unsigned i = 0; i < 3; ++i) p[i] = (corner >> i & 1) != 0 ? box.max[i] : box.min[i];
  return p;
}

// Where the picture has a point, in pixels from its middle, and its depth from -1 to 1.
Vector in_picture(const Viewpoint& viewpoint, const Camera& camera, const Vector& world) {
  const auto p = viewpoint.in_scene(world);
  const auto row = [&](std::size_t i) {
    const auto& m = viewpoint.projection;
    return double(m[i]) * p[0] + double(m[4 + i]) * p[1] + double(m[8 + i]) * p[2] + double(m[12 + i]);
  };
  return {row(0) / row(3) * camera.viewport[0] / 2, row(1) / row(3) * camera.viewport[1] / 2, row(2) / row(3)};
}

TEST(Viewpoint, ThreeQuarterViewShowsTheWholeBoxAndFillsThePicture) {
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    Box box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = uniform(random, -100, 100);
      box.max[axis] = box.min[axis] + std::pow(10.0, uniform(random, -2, 2));
    }
    const Camera camera = three_quarter_view(box, std::nullopt);
    EXPECT_TRUE(check_lod({.camera = camera}));
    EXPECT_EQ(camera.viewport, (std::array{1280, 960}));
    const Viewpoint viewpoint(camera, box);
    double fullest = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const Vector p = in_picture(viewpoint, camera, corner_of(box, corner));
      fullest = std::max({fullest, std::abs(p[0]) / 640, std::abs(p[1]) / 480});
      EXPECT_LT(std::abs(p[2]), 1);
    }
    EXPECT_LT(fullest, 1);
    EXPECT_GT(fullest, 0.9);
  }
}

TEST(Viewpoint, ThreeQuarterViewLooksIntoACut) {
  const Box box{{0, 0, 0}, {1, 2, 3}};
  std::mt19937 random(8);
  for (int i = 0; i < 100; ++i) {
    const Plane cut{{0.5, 1, 1.5}, testing::random_direction(random)};
    const Camera camera = three_quarter_view(box, cut);
    EXPECT_GT(dot(minus(camera.eye, cut.point), cut.normal), 0);
  }
}

TEST(Viewpoint, PutsPointsWhereAPinholeCameraDoes) {
  const Grid grid{.dims = {20, 30, 40}, .affine = Affine::of({1, 0.5, 2}, {-5, 100, 3})};
  const Box box = box_of(grid);
  std::mt19937 random(9);
  for (int i = 0; i < 200; ++i) {
    const Camera camera = testing::random_camera(grid, random);
    const NaiveCamera naive(camera);
    const Viewpoint viewpoint(camera, box);
    for (int j = 0; j < 20; ++j) {
      Vector p;
      for (std::size_t axis = 0; axis < 3; ++axis) p[axis] = uniform(random, box.min[axis], box.max[axis]);
      if (naive.depth(p) < 0.05 * viewpoint.unit) continue;
      const auto expected = naive.project(p);
      const Vector got = in_picture(viewpoint, camera, p);
      const double tolerance = 1e-4 * (camera.viewport[1] + std::hypot(expected[0], expected[1]));
      EXPECT_NEAR(got[0], expected[0], tolerance);
      EXPECT_NEAR(got[1], expected[1], tolerance);
      EXPECT_LT(std::abs(got[2]), 1);
    }
  }
}

TEST(Viewpoint, TellsDepthsApartFromAfar) {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  const Camera camera{.eye = {0, 0, 1e4}, .look_at = {0, 0, 0}, .fov = 0.02};
  const Viewpoint viewpoint(camera, box);
  EXPECT_LT(in_picture(viewpoint, camera, {0, 0, 0.001})[2], in_picture(viewpoint, camera, {0, 0, 0})[2]);
  EXPECT_LT(std::abs(in_picture(viewpoint, camera, {0, 0, 1})[2]), 1);
  EXPECT_LT(std::abs(in_picture(viewpoint, camera, {0, 0, -1})[2]), 1);
}

}  // namespace
}  // namespace intervale
