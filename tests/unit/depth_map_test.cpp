#include "common/view/depth_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <vector>

#include "tests/support/affines.h"
#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::NaiveCamera;
using testing::Vector;
using Triangle = std::array<Vec3, 3>;

const Grid kDepthGrid{{40, 30, 20}, Affine::of({0.5, 1, 3}, {-4, 100, 7})};

// How far along the line of sight a ray meets a triangle first; `ahead` is 1 on the line of sight of the ray.
std::optional<double> depth_along(const Vector& eye, const Vector& ray, const Triangle& t) {
  const Vector e1 = testing::minus(t[1], t[0]), e2 = testing::minus(t[2], t[0]), n = testing::cross(ray, e2), from = testing::minus(eye, t[0]);
  const double d = testing::dot(e1, n);
  if (d == 0) return {};
  const double u = testing::dot(from, n) / d;
  const Vector q = testing::cross(from, e1);
  const double v = testing::dot(ray, q) / d, depth = testing::dot(e2, q) / d;
  if (u < 0 || v < 0 || u + v > 1 || depth <= 0) return {};
  return depth;
}

struct Scene {
  Camera camera;
  NaiveCamera naive;
  std::vector<Triangle> triangles;
  DepthMap map;

  Scene(const Grid& grid, std::mt19937& random) : camera(testing::random_camera(grid, random)), naive(camera) {
    DepthBuffer buffer(camera);
    for (int i = int(random() % 30); i >= 0; --i) {
      Triangle t;
      for (Vec3& corner : t) {
        for (std::size_t k = 0; k < 3; ++k) corner[k] = testing::uniform(random, -0.5, 1.5) * (grid.dims[k] - 1);
        corner = grid.affine.point(corner);
      }
      triangles.push_back(t);
      buffer.draw(t);
    }
    map = buffer.map();
  }
  // Of the ray through the middle of a sample of a cell, 2 x 2 a cell; infinite: it meets nothing.
  [[nodiscard]] double nearest(int column, int row) const {
    const double tan_y = std::tan(camera.fov * std::numbers::pi / 360), tan_x = tan_y * camera.viewport[0] / camera.viewport[1];
    const double x = ((column + 0.5) / map.width - 1) * tan_x, y = (1 - (row + 0.5) / map.height) * tan_y;
    const Vector ray = testing::along(testing::along(naive.ahead(), x, naive.right()), y, naive.up());
    double depth = std::numeric_limits<double>::infinity();
    for (const Triangle& t : triangles) {
      const bool reaches_behind = std::any_of(t.begin(), t.end(), [this](const Vec3& p) { return naive.depth(p) <= 0; });
      if (!reaches_behind) depth = std::min(depth, depth_along(camera.eye, ray, t).value_or(depth));
    }
    return depth;
  }
};

class DepthMaps : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};  // the seed is the test's number
  Grid grid_{{40, 30, 20}, testing::random_affine(random_, GetParam() % 5)};
};

TEST_P(DepthMaps, AreWhatRaysMeet) {
  std::size_t closed = 0, wrong = 0, all = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Scene scene(grid_, random_);
    ASSERT_TRUE(check_depth_map(scene.map));
    EXPECT_EQ(std::max(scene.map.width, scene.map.height), DepthMap::kMaxSide);
    for (int i = 0; i < 100; ++i) {
      const int x = int(random_() % unsigned(scene.map.width)), y = int(random_() % unsigned(scene.map.height));
      double farthest = 0;
      for (int k = 0; k < 4; ++k) farthest = std::max(farthest, scene.nearest(2 * x + k % 2, 2 * y + k / 2));
      const std::uint8_t code = scene.map.codes[std::size_t(y * scene.map.width + x)];
      ++all;
      closed += code != DepthMap::kOpenCode;
      // Where a ray passes close to an edge, rounding decides.
      if (std::isinf(farthest) != (code == DepthMap::kOpenCode)) {
        ++wrong;
      } else if (!std::isinf(farthest)) {
        const double depth = scene.map.depth_of(code), step = std::pow(scene.map.farthest / scene.map.nearest, 1.0 / DepthMap::kLastCode);
        wrong += !(depth >= farthest * (1 - 1e-5) && depth <= farthest * step * (1 + 1e-5));
      }
    }
  }
  EXPECT_GT(closed, 20u);
  EXPECT_LE(wrong * 200, all);
}

TEST_P(DepthMaps, WhatIsHiddenLiesBehindThem) {
  std::size_t hidden = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const Scene scene(grid_, random_);
    const Occlusion occlusion(scene.map, scene.camera, grid_);
    for (int i = 0; i < 200; ++i) {
      ScreenError::Region region;
      const double size = std::pow(10.0, testing::uniform(random_, -2, -0.5));
      for (std::size_t k = 0; k < 3; ++k) {
        region.middle[k] = testing::uniform(random_, -0.5, 1.5) * grid_.dims[k];
        region.reach[k] = testing::uniform(random_, 0, size) * grid_.dims[k];
      }
      if (!occlusion.hides(region)) continue;
      ++hidden;
      for (int point = 0; point < 20; ++point) {
        Vec3 sample, reach;
        for (std::size_t k = 0; k < 3; ++k) {
          const double share = testing::uniform(random_, 0, 1);
          reach[k] = region.reach[k] * share;
          sample[k] = region.middle[k] + (region.reach[k] - reach[k]) * testing::uniform(random_, -1, 1);
        }
        // As far inside as a region of its own may be.
        EXPECT_TRUE(occlusion.hides({sample, scaled(0.999, reach)}) || !scene.naive.shows(grid_.affine.point(sample)));
        const Vec3 p = grid_.affine.point(sample);
        if (!scene.naive.shows(p)) continue;
        const auto [px, py] = scene.naive.project(p);
        const int x = int((px / scene.camera.viewport[0] + 0.5) * scene.map.width), y = int((0.5 - py / scene.camera.viewport[1]) * scene.map.height);
        if (x < 0 || y < 0 || x >= scene.map.width || y >= scene.map.height) continue;
        const std::uint8_t code = scene.map.codes[std::size_t(y * scene.map.width + x)];
        ASSERT_NE(code, DepthMap::kOpenCode);
        EXPECT_GT(scene.naive.depth(p), scene.map.depth_of(code) * (1 - 1e-6));
      }
    }
  }
  EXPECT_GT(hidden, 20u);
}

INSTANTIATE_TEST_SUITE_P(Random, DepthMaps, ::testing::Range(0u, 10u));

TEST(Occlusion, AWallHidesWhatIsBehindItAndNothingElse) {
  const Camera camera{.eye = {6, 115, -100}, .look_at = {6, 115, 30}, .up = {0, 1, 0}, .fov = 60, .viewport = {800, 600}};
  DepthBuffer buffer(camera);
  const double z = kDepthGrid.affine.point({0, 0, 10})[2];
  buffer.draw({Vec3{-1000, -1000, z}, Vec3{1000, -1000, z}, Vec3{0, 2000, z}});
  const Occlusion occlusion(buffer.map(), camera, kDepthGrid);
  EXPECT_TRUE(occlusion.hides({{20, 15, 18}, {1, 1, 1}}));
  EXPECT_FALSE(occlusion.hides({{20, 15, 11}, {1, 1, 1}})) << "it touches the wall";
  EXPECT_FALSE(occlusion.hides({{20, 15, 11.5}, {1, 1, 1}})) << "too close to it for its size";
  EXPECT_FALSE(occlusion.hides({{20, 15, 2}, {1, 1, 1}})) << "before it";
  EXPECT_FALSE(occlusion.hides({{20, 15, 10}, {100, 100, 100}})) << "around the eye";
  const Occlusion empty(DepthBuffer(camera).map(), camera, kDepthGrid);
  EXPECT_FALSE(empty.hides({{20, 15, 18}, {1, 1, 1}}));
}

TEST(DepthMap, OnesThatCannotBeAreRefused) {
  const DepthMap good{2, 1, 1, 10, {0, 255}};
  EXPECT_TRUE(check_depth_map(good));
  std::vector<DepthMap> bad(8, good);
  bad[0].width = 0;
  bad[1].height = 65;
  bad[2].codes.pop_back();
  bad[3].nearest = 0;
  bad[4].nearest = 11;
  bad[5].farthest = std::numeric_limits<double>::infinity();
  bad[6].nearest = std::nan("");
  bad[7] = {};
  for (const DepthMap& map : bad) EXPECT_FALSE(check_depth_map(map)) << &map - bad.data();
}

}  // namespace
}  // namespace intervale
