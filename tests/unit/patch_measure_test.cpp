#include "common/ranges/patch_measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "common/ranges/patch_polygon.h"
#include "tests/support/bisection.h"

namespace intervale {
namespace {

Vec3 random_point(std::mt19937& random, double from, double to) {
  std::uniform_real_distribution<double> number(from, to);
  return {number(random), number(random), number(random)};
}

// All points of a patch have its value, and lie in the tetrahedron; its border is where one of the tetrahedron's
// coordinates is 0. Distances are those to the nearest of many points of the sides.
TEST(PatchPolygon, IsWhereTheInterpolantHasTheValue) {
  std::mt19937 random(1);
  std::array<int, 5> corners{};
  for (int trial = 0; trial < 2000; ++trial) {
    std::array<Vec3, 4> at;
    std::array<double, 4> values;
    for (int i = 0; i < 4; ++i) {
      at[i] = random_point(random, -1, 1);
      values[i] = double(random() % 9);
    }
    const Isosurface surface{double(random() % 8) + 0.5 * double(random() % 2), random() % 2 == 0};
    const PatchPolygon patch(at, values, surface);
    ++corners[patch.count];
    const auto above =
        std::count_if(values.begin(), values.end(), [&](double v) { return surface.is_beta ? v > surface.value : v >= surface.value; });
    ASSERT_EQ(patch.count, above == 0 || above == 4 ? 0 : above == 2 ? 4 : 3);
    if (patch.count == 0) {
      ASSERT_TRUE(std::isinf(PatchBorder(patch).squared_distance({})));
      continue;
    }
    const double volume = triple_product(subtract(at[1], at[0]), subtract(at[2], at[0]), subtract(at[3], at[0]));
    if (std::abs(volume) < 1e-3) continue;
    const auto coordinates = [&](const Vec3& p) {
      std::array<double, 4> c{};
      for (int i = 0; i < 4; ++i) {
        auto corner = at;
        corner[i] = p;
        c[i] = triple_product(subtract(corner[1], corner[0]), subtract(corner[2], corner[0]), subtract(corner[3], corner[0])) / volume;
      }
      return c;
    };
    const auto has_value = [&](const Vec3& p, bool is_at_border) {
      const auto c = coordinates(p);
      double value = 0;
      for (int i = 0; i < 4; ++i) value += c[i] * values[i];
      EXPECT_NEAR(value, surface.value, 1e-6);
      const double least = *std::min_element(c.begin(), c.end());
      EXPECT_GE(least, -1e-6);
      if (is_at_border) {
        EXPECT_LE(least, 1e-6);
      }
    };
    has_value(patch.middle(), false);
    const Vec3 p = random_point(random, -2, 2);
    double nearest = 1e300;
    constexpr int kSteps = 256;
    for (int i = 0; i < patch.count; ++i) {
      for (int step = 0; step <= kSteps; ++step) {
        const Vec3 q = lerp(patch.corner[i], patch.corner[(i + 1) % patch.count], double(step) / kSteps);
        if (step % 16 == 0) has_value(q, true);
        nearest = std::min(nearest, length(subtract(p, q)));
      }
    }
    const double distance = std::sqrt(PatchBorder(patch).squared_distance(p));
    ASSERT_LE(distance, nearest + 1e-9);
    ASSERT_GE(distance, nearest - 4.0 / kSteps);
  }
  EXPECT_GT(corners[3], 100);
  EXPECT_GT(corners[4], 100);
}

// In each of the last tetrahedra of bisection, linear between the samples at its corners.
TEST(FinestField, IsLinearInTheFinestTetrahedra) {
  std::mt19937 random(2);
  constexpr int kSide = 5;
  std::vector<std::uint8_t> samples(kSide * kSide * kSide);
  for (auto& s : samples) s = std::uint8_t(random());
  const Field<std::uint8_t> field{samples, {kSide - 1, kSide - 1, kSide - 1}};
  const FinestField<std::uint8_t> finest(field);
  std::size_t tets = 0;
  for (const auto& [doubled, diamond] : testing::bisect(2)) {
    if (doubled[0] % 2 == 0 || doubled[1] % 2 == 0 || doubled[2] % 2 == 0) continue;
    for (const testing::Tet& tet : diamond.tets) {
      Vec3 p{};
      double expected = 0, left = 1;
      for (int i = 0; i < 4; ++i) {
        const double weight = i == 3 ? left : left * std::uniform_real_distribution(0.0, 1.0)(random);
        left -= weight;
        for (int k = 0; k < 3; ++k) p[k] += weight * tet[i][k];
        expected += weight * field.at({tet[i][0], tet[i][1], tet[i][2]});
      }
      ASSERT_NEAR(finest.at(p), expected, 1e-9);
      ++tets;
    }
  }
  EXPECT_GT(tets, 300u);
  EXPECT_EQ(finest.at({-7, -1, -0.5}), field.at({0, 0, 0})) << "outside, what is nearest";
  EXPECT_EQ(finest.at({7, 9, 4.5}), field.at({4, 4, 4}));
}

// A plane with a shaft through it: of the patches that cover the shaft no point above is on the surface.
TEST(PatchMeasure, APatchOverAHoleIsFar) {
  constexpr int kSide = 17, kMiddle = 8;
  for (const double radius : {0.0, 6.0}) {
    std::vector<float> samples(kSide * kSide * kSide);
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const int layer = i / (kSide * kSide);
      const double x = i % kSide - kMiddle, y = i / kSide % kSide - kMiddle, z = layer - kMiddle + 0.5;
      samples[std::size_t(i)] = float(std::hypot(x, y) < radius ? std::min(z, -1.0) : z);
    }
    const Field<float> field{samples, {kSide - 1, kSide - 1, kSide - 1}};
    const Domain domain({kSide, kSide, kSide});
    const PatchMeasure<float> measure(field, Affine{}, domain);
    const Isosurfaces surfaces({0, std::numeric_limits<double>::infinity()});
    const Diamond d(Vertex{kMiddle, kMiddle, kMiddle});
    const double found = measure.within_patches(d, surfaces, 0, 5);
    if (radius == 0) {
      EXPECT_LT(found, 1e-5);
    } else {
      EXPECT_EQ(found, 5);
    }
    EXPECT_EQ(measure.within_patches(d, surfaces, 7, 5), 7) << "no less than what is known";
  }
}

// No time without end, no place outside the field, whatever the spacing: squares of the numbers may not be any.
TEST(PatchMeasure, SpacingsMayBeFarFromOneAndFromEachOther) {
  std::mt19937 random(4);
  constexpr int kSide = 9;
  std::vector<std::uint8_t> samples(kSide * kSide * kSide);
  for (auto& s : samples) s = std::uint8_t(random());
  const Field<std::uint8_t> field{samples, {kSide - 1, kSide - 1, kSide - 1}};
  const Domain domain({kSide, kSide, kSide});
  const Isosurfaces surfaces({100, 200});
  for (const Vec3& spacing : {Vec3{1, 1, 1e-12}, Vec3{1e-200, 1e-200, 1e-200}, Vec3{1e-160, 1e-155, 1e-150}, Vec3{1e150, 1e150, 1e150},
                              Vec3{1, 1e-9, 1e9}, Vec3{1e-310, 1e-310, 1e-310}, Vec3{1e300, 1, 1e-300}}) {
    const PatchMeasure<std::uint8_t> measure(field, Affine::of(spacing), domain);
    const double width = 4 * std::max({spacing[0], spacing[1], spacing[2]});
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          if (scale_of({x, y, z}) > 2) continue;
          const Diamond d(Vertex{x, y, z});
          const double found = measure.within_patches(d, surfaces, 0, width * d.h);
          ASSERT_GE(found, 0);
          ASSERT_LE(found, width * d.h);
        }
      }
    }
  }
  EXPECT_EQ(FinestField<std::uint8_t>(field).at({std::nan(""), 0, 0}), field.at({0, 0, 0}));
}

}  // namespace
}  // namespace intervale
