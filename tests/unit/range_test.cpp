#include "common/patch/range.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "tests/support/special_values.h"

namespace intervale {
namespace {

TEST(Range, AValueEqualToABoundIsInside) {
  EXPECT_EQ(side_of(1, {1, 2}), Side::inside);
  EXPECT_EQ(side_of(2, {1, 2}), Side::inside);
  EXPECT_EQ(side_of(1.5, {1.5, 1.5}), Side::inside);
  EXPECT_EQ(side_of(0.1f, {0.1, 1}), Side::inside) << "0.1f is greater than 0.1: compared as doubles";
}

TEST(Range, AnInfiniteEndHasNoSurface) {
  EXPECT_EQ(cuts_between(-1e300, 5, {-kInf, 0}).count, 1);
  EXPECT_EQ(cuts_between(-1e300, 5, {-kInf, kInf}).count, 0);
}

TEST(Range, TheCutNearerToTheFirstEndStaysNearer) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> value(-10, 10), width(1e-9, 0.1);
  for (int i = 0; i < 100000; ++i) {
    const double low = value(random);
    const Range range{low, low + width(random)};
    const double below = range.alpha - std::abs(value(random)) - 1e-6, above = range.beta + std::abs(value(random)) + 1e-6;
    const Cuts up = cuts_between(below, above, range), down = cuts_between(above, below, range);
    ASSERT_EQ(up.count, 2);
    ASSERT_LT(up.q[0], up.q[1]);
    ASSERT_GT(down.q[0], down.q[1]);
  }
}

TEST(Range, AnEdgeIsCutAlikeFromBothEnds) {
  for (int a = 0; a < 10; ++a) {
    for (int b = 0; b < 10; ++b) {
      for (const Range range : {Range{3, 5.5}, Range{4.5, 4.5}, Range{4.2, 4.21}}) {
        if (side_of(a, range) == side_of(b, range)) continue;
        const Cuts there = cuts_between(a, b, range), back = reversed(cuts_between(b, a, range));
        ASSERT_EQ(there.count, back.count);
        for (int i = 0; i < there.count; ++i) EXPECT_EQ(there.q[i], back.q[i]);
      }
    }
  }
}

TEST(Range, TheCutOfOneSurfaceIsThatOfTheRangeItBounds) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> value(-10, 10);
  for (int i = 0; i < 100000; ++i) {
    const double from = value(random), to = value(random), kappa = value(random);
    for (const Range range : {Range{kappa, kInf}, Range{-kInf, kappa}}) {
      const Cuts cuts = cuts_between(from, to, range);
      if (cuts.count != 0) {
        ASSERT_EQ(cuts.q[0], cut_between(from, to, kappa)) << from << " to " << to << ", " << kappa;
      }
    }
  }
}

TEST(Range, EqualBoundsCutAtOnePlace) {
  const Cuts c = cuts_between(0, 10, {5, 5});
  EXPECT_EQ(c.count, 2);
  EXPECT_EQ(c.q[0], c.q[1]);
}

TEST(Range, ACutIsWithinHalfAStepOfTheTruth) {
  for (double kappa = 0.001; kappa < 10; kappa += 0.0137) {
    const Cuts c = cuts_between(0, 10, {kappa, kInf});
    ASSERT_EQ(c.count, 1);
    EXPECT_LE(std::abs((c.q[0] + 0.5) / 256 - kappa / 10), 0.5 / 256 + 1e-12);
  }
}

TEST(Range, TwoCutsInOneStepAreOffByAStepAtMost) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0, 1);
  for (int i = 0; i < 100000; ++i) {
    const int step = int(random() % 256);
    double a = (step + share(random)) / 256, b = (step + share(random)) / 256;
    if (a > b) std::swap(a, b);
    if (a == b || a == 0) continue;
    const Cuts up = cuts_between(0, 1, {a, b}), down = reversed(cuts_between(1, 0, {a, b}));
    ASSERT_EQ(up.count, 2);
    ASSERT_LT(up.q[0], up.q[1]);
    ASSERT_TRUE(up.q[0] == down.q[0] && up.q[1] == down.q[1]);
    const double most = (step == 0 || step == 255 ? 1.5 : 1) / 256 + 1e-12;
    EXPECT_LE(std::abs((up.q[0] + 0.5) / 256 - a), most);
    EXPECT_LE(std::abs((up.q[1] + 0.5) / 256 - b), most);
  }
}

TEST(Range, EndsFarApartDoNotOverflow) {
  const Cuts c = cuts_between(-1e308, 1e308, {0, kInf});
  ASSERT_EQ(c.count, 1);
  EXPECT_NEAR(c.q[0], 128, 1);
}

}  // namespace
}  // namespace intervale
