#include "client/view/corner_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/mesh/normals.h"

namespace intervale {
namespace {

using SideInSteps = std::array<std::int32_t, 3>;

class RandomTriangles {
 public:
  explicit RandomTriangles(unsigned seed) : random_(seed) {}
  Affine affine() {
    std::uniform_real_distribution<double> some(-1, 1);
    Affine made;
    do {
      const double unit = std::pow(10, 3 * some(random_));
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) made.rows[4 * i + j] = unit * some(random_);
    } while (std::abs(made.relative_determinant()) < 0.05);
    return made;
  }
  std::array<SideInSteps, 2> sides(int most) {  // of a triangle that is no sliver
    std::uniform_int_distribution<std::int32_t> some(-most, most);
    std::array<SideInSteps, 2> made;
    double area = 0;
    do {
      for (SideInSteps& side : made)
        for (std::int32_t& c : side) c = some(random_);
      const Vec3 u{double(made[0][0]), double(made[0][1]), double(made[0][2])}, v{double(made[1][0]), double(made[1][1]), double(made[1][2])};
      area = length(cross(u, v)) / (1e-9 + length(u) * length(v));
    } while (area < 0.02);
    return made;
  }

 private:
  std::mt19937 random_;
};

class CornerNormalsOf : public ::testing::TestWithParam<int> {};

TEST_P(CornerNormalsOf, AreThoseInDoublePrecision) {
  RandomTriangles triangles{unsigned(GetParam())};
  for (int round = 0; round < 200; ++round) {
    const Affine affine = triangles.affine();
    const CornerNormals normals(affine);
    CornerNormals::Sides sides;
    std::array<std::array<NormalSum, 3>, kLanes> expected;
    for (std::size_t i = 0; i < kLanes; ++i) {
      const auto [u, v] = triangles.sides(GetParam());
      const auto in_world = [&](const SideInSteps& s) { return affine.direction({double(s[0]), double(s[1]), double(s[2])}); };
      expected[i] = angle_weighted_normals({Vec3{}, in_world(u), in_world(v)}, [](double y, double x) { return std::atan2(y, x); });
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sides.first[axis][i] = float(u[axis]);
        sides.second[axis][i] = float(v[axis]);
      }
    }
    CornerNormals::Sums sums;
    normals.sum(sides, sums);
    for (std::size_t i = 0; i < kLanes; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis) ASSERT_NEAR(sums[k][axis][i], expected[i][k][axis], 1e-4 * kNormalSteps) << "round " << round;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Longest, CornerNormalsOf, ::testing::Values(3, 512, 1 << 22));

// What is added can be taken back in another lane.
TEST(CornerNormals, AreTheSameInEveryLane) {
  RandomTriangles triangles(7);
  for (int round = 0; round < 100; ++round) {
    const CornerNormals normals(triangles.affine());
    const auto [u, v] = triangles.sides(100);
    CornerNormals::Sides sides;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sides.first[axis].fill(float(u[axis]));
      sides.second[axis].fill(float(v[axis]));
    }
    CornerNormals::Sums sums;
    normals.sum(sides, sums);
    for (const auto& corner : sums) {
      for (const auto& axis : corner) {
        for (const std::int32_t sum : axis) ASSERT_EQ(sum, axis[0]);
      }
    }
  }
}

TEST(CornerNormals, AreZeroForTrianglesWithoutArea) {
  const CornerNormals normals(Affine::of({2, 3, 4}));
  CornerNormals::Sides sides;
  for (std::size_t i = 1; i < kLanes; ++i) {  // lane 0: a point
    for (std::size_t axis = 0; axis < 3; ++axis) sides.first[axis][i] = float((axis + 1) * i);
    const float along = float(i % 4) - 1;
    for (std::size_t axis = 0; axis < 3; ++axis) sides.second[axis][i] = along * sides.first[axis][i];
  }
  CornerNormals::Sums sums;
  normals.sum(sides, sums);
  for (const auto& corner : sums) {
    for (const auto& axis : corner) {
      for (const std::int32_t sum : axis) EXPECT_EQ(sum, 0);
    }
  }
}

TEST(UnitNormals, AreRoundedAndZeroStaysZero) {
  VectorLanes<float> vectors{};
  std::mt19937 random(3);
  std::uniform_real_distribution<float> some(-1e9f, 1e9f);
  for (std::size_t i = 1; i < kLanes; ++i)
    for (std::size_t axis = 0; axis < 3; ++axis) vectors[axis][i] = some(random);
  VectorLanes<std::int8_t> normals{};
  make_unit_normals(vectors, normals);
  for (std::size_t i = 0; i < kLanes; ++i) {
    const Vec3 v{vectors[0][i], vectors[1][i], vectors[2][i]};
    const double size = length(v);
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(double(normals[axis][i]), size > 0 ? 127 * v[axis] / size : 0, 0.5 + 1e-4);
  }
}

}  // namespace
}  // namespace intervale
