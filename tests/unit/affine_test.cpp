#include "common/diamond/affine.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/patch/description.h"
#include "common/view/lod.h"
#include "common/view/seen_box.h"
#include "tests/support/affines.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

void expect_near(const Vec3& a, const Vec3& b, double within) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(a[i], b[i], within);
}

class Affines : public ::testing::TestWithParam<unsigned> {
 protected:
  [[nodiscard]] Vec3 random_point(double most) {
    return {testing::uniform(random_, -most, most), testing::uniform(random_, -most, most), testing::uniform(random_, -most, most)};
  }
  std::mt19937 random_{GetParam()};
  Affine map_ = testing::random_affine(random_, GetParam() % 5);
};

TEST_P(Affines, PointsAndDirectionsComeBackByTheInverse) {
  const Affine back = map_.inverse();
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 p = random_point(9);
    expect_near(back.point(map_.point(p)), p, 1e-11);
    expect_near(back.direction(map_.direction(p)), p, 1e-11);
  }
  EXPECT_NEAR(back.determinant() * map_.determinant(), 1, 1e-11);
  EXPECT_EQ(map_.is_mirrored(), map_.determinant() < 0);
}

TEST_P(Affines, ATransposedNormalMeasuresInSamples) {
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 n = random_point(1), v = random_point(9);
    EXPECT_NEAR(dot(n, map_.direction(v)), dot(map_.transposed(n), v), 1e-11);
    expect_near(map_.inverse().transposed(map_.transposed(n)), n, 1e-11);
  }
}

TEST_P(Affines, WhatIsTurnedKeepsLengthsAndIsTheSameForEveryRotation) {
  const TurnedAffine turned(map_);
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3 p = random_point(9);
    expect_near(turned.turned(map_.point(p)), turned.map.point(p), 1e-12 * 100);
    EXPECT_NEAR(length(turned.turned(p)), length(p), 1e-12 * 100);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_GT(turned.map.rows[5 * i], 0);
    for (std::size_t j = 0; j < i; ++j) EXPECT_EQ(turned.map.rows[4 * i + j], 0);
  }
  const TurnedAffine other(testing::rotated(map_, testing::random_axes(random_)));
  for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(other.map.rows[i], turned.map.rows[i], 1e-12 * 100);
}

TEST_P(Affines, TheBoxAroundTheSamplesHoldsAllCornersAndNoMore) {
  const Grid grid{{4, 9, 3}, map_};
  const Box box = box_of(grid);
  Box corners{{kInf, kInf, kInf}, {-kInf, -kInf, -kInf}};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const Vec3 p = map_.point({corner & 1 ? 3.0 : 0.0, corner & 2 ? 8.0 : 0.0, corner & 4 ? 2.0 : 0.0});
    for (std::size_t i = 0; i < 3; ++i) {
      corners.min[i] = std::min(corners.min[i], p[i]);
      corners.max[i] = std::max(corners.max[i], p[i]);
    }
  }
  expect_near(box.min, corners.min, 1e-12 * 100);
  expect_near(box.max, corners.max, 1e-12 * 100);
  EXPECT_EQ(box_of({grid.dims, Affine::of({0.5, 2, 1}, {-1, 3, 0})}), (Box{{-1, 3, 0}, {0.5, 19, 2}}));
}

// A naive model: the world box around the eight corners of a diamond's box.
TEST_P(Affines, ADiamondMeetsARegionThatItsWorldBoxTouches) {
  const Grid grid{{17, 17, 17}, map_};
  const Box all = box_of(grid);
  unsigned met = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Box roi;
    for (std::size_t i = 0; i < 3; ++i) {
      roi.min[i] = testing::uniform(random_, all.min[i], all.max[i]);
      roi.max[i] = roi.min[i] + testing::uniform(random_, 0, all.max[i] - all.min[i]) / 4;
    }
    const SeenBox seen(roi, grid);
    const Vertex c{std::int32_t(random_() % 17), std::int32_t(random_() % 17), std::int32_t(random_() % 17)};
    const std::int32_t h = 1 << random_() % 3;
    bool meets = true;
    for (std::size_t i = 0; i < 3; ++i) {
      double low = kInf, high = -kInf;
      for (unsigned corner = 0; corner < 8; ++corner) {
        const double at = map_.point({c.x + (corner & 1 ? h : -h) * 1.0, c.y + (corner & 2 ? h : -h) * 1.0, c.z + (corner & 4 ? h : -h) * 1.0})[i];
        low = std::min(low, at);
        high = std::max(high, at);
      }
      meets = meets && high >= roi.min[i] && low <= roi.max[i];
    }
    ASSERT_EQ(seen.meets(c, h), meets) << "trial " << trial;
    ASSERT_EQ(seen.meets(Vec3{double(c.x), double(c.y), double(c.z)}, Vec3{double(h), double(h), double(h)}), meets);
    met += meets;
  }
  EXPECT_GT(met, 5u);
  EXPECT_LT(met, 295u);
}

INSTANTIATE_TEST_SUITE_P(Random, Affines, ::testing::Range(0u, 20u));

// What was computed with spacing and origin stays the same to the bit.
TEST(Affine, ParallelAxesGiveTheResultsOfSpacingAndOrigin) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto any = [&random] { return testing::uniform(random, 1e-3, 99); };
    const Vec3 spacing{any(), any(), any()}, origin{any(), any(), any()}, p{any(), any(), any()};
    const Affine map = Affine::of(spacing, origin);
    EXPECT_TRUE(map.is_axis_parallel());
    EXPECT_EQ(map.spacing(), spacing);
    EXPECT_EQ(map.origin(), origin);
    const TurnedAffine turned(map);
    EXPECT_EQ(turned.turned(p), p);
    EXPECT_EQ(turned.map, map);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(map.point(p)[i], origin[i] + spacing[i] * p[i]);
      EXPECT_EQ(map.reach(p)[i], spacing[i] * p[i]);
      EXPECT_EQ(map.inverse().rows[5 * i], 1 / spacing[i]);
    }
  }
}

TEST(Affine, GridsThatCannotBeAreRefusedInOneLine) {
  const double nan = std::nan(""), most = std::numeric_limits<double>::max();
  for (const Affine& map : {Affine::of({0, 1, 1}), Affine::of({1, nan, 1}), Affine::of({1, 1, kInf}), Affine::of({1, 1, 1}, {0, nan, 0}),
                            Affine::of({1, 1, most}), Affine::of({most / 10, 1, 1}, {most / 2, 0, 0}), Affine{{1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0}},
                            Affine{{1, 1, 0, 0, 1, 1 + 1e-13, 0, 0, 0, 0, 1, 0}}, Affine{{most / 4, -most / 4, 0, 0, 1, 2, 0, 0, 0, 0, 1, 0}}}) {
    const auto checked = check_grid({{9, 9, 9}, map});
    ASSERT_FALSE(checked);
    EXPECT_EQ(checked.error().message.find('\n'), std::string::npos);
  }
  for (const Affine& map : {Affine::of({-1, 1, 1}), Affine::of({1e-200, 1e200, 1}), Affine{{0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0}},
                            Affine{{1, 1, 0, 0, 1, 1 + 1e-9, 0, 0, 0, 0, 1, 0}}})
    EXPECT_TRUE(check_grid({{9, 9, 9}, map}));
}

TEST(Labels, AreShortTextsWithoutControlCharacters) {
  for (const char* good : {"", "mm", "\u00b5m", "g/cm\u00b3", "a b"}) EXPECT_TRUE(is_label(good)) << good;
  for (const std::string& bad : {std::string(65, 'x'), std::string("a\nb"), std::string("\x1b[2J"), std::string("\xc2\x9b"), std::string("\xff"),
                                 std::string("\xc0\x80"), std::string("\xed\xa0\x80"), std::string("\xf4\x90\x80\x80"), std::string("\xe2\x82")})
    EXPECT_FALSE(is_label(bad));
  EXPECT_TRUE(is_label(std::string(64, 'x')));
  EXPECT_FALSE(check_labels({"mm", "a\tb", ""}));
  EXPECT_FALSE(check_labels({"", "", "", "RA\n"}));
}

}  // namespace
}  // namespace intervale
