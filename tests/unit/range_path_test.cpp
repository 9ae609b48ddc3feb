// Laws of the ranges that the clients of a load drag.
#include "client/load/range_path.h"
#include "tests/support/special_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

namespace intervale {
namespace {

constexpr std::uint64_t kViews = 500;

RangePath path_of(const Range& start, std::uint64_t seed) { return {.start = start, .values = {-20, 180}, .seed = seed}; }

std::vector<Range> ranges_of(const RangePath& path) {
  std::vector<Range> ranges;
  ranges.reserve(kViews);
  for (std::uint64_t number = 0; number < kViews; ++number) ranges.push_back(range_of(path, number));
  return ranges;
}

TEST(RangePath, EveryRangeIsWithinTheValuesAndTheRightWayRound) {
  for (const Range& start :
       {Range{40, 60}, Range{-20, 180}, Range{7, 7}, Range{-20, -20}, Range{180, 180}, Range{-kInf, 3}, Range{-kInf, kInf}, Range{500, 600}}) {
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
      for (const Range& range : ranges_of(path_of(start, seed))) {
        ASSERT_LE(-20, range.alpha) << "seed " << seed;
        ASSERT_LE(range.alpha, range.beta) << "seed " << seed;
        ASSERT_LE(range.beta, 180) << "seed " << seed;
      }
    }
  }
}

TEST(RangePath, ItStartsWhereItIsTold) {
  EXPECT_EQ(range_of(path_of({0.1, 60.7}, 3), 0), (Range{0.1, 60.7}));
  EXPECT_EQ(range_of(path_of({-kInf, 500}, 3), 0), (Range{-20, 180}));
  EXPECT_EQ(upper_half({-20, 180}), (Range{80, 180}));
}

// Ten moves of alpha, ten of beta, and so on; 5 % of the values is 10, and no move is more than twice that.
TEST(RangePath, OneEndMovesAtATimeByASmallStep) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto ranges = ranges_of(path_of({30, 90}, seed));
    double sum = 0;
    for (std::uint64_t number = 1; number < kViews; ++number) {
      const double alpha = std::abs(ranges[number].alpha - ranges[number - 1].alpha), beta = std::abs(ranges[number].beta - ranges[number - 1].beta);
      const bool is_alpha = (number - 1) / 10 % 2 == 0;
      EXPECT_EQ(is_alpha ? beta : alpha, 0) << "seed " << seed << ", number " << number;
      EXPECT_LE(alpha + beta, 20 + 1e-9) << "seed " << seed << ", number " << number;
      sum += alpha + beta;
    }
    EXPECT_GT(sum / kViews, 5) << "seed " << seed;  // turns shorten a move
  }
}

TEST(RangePath, AnEndGoesAllOverItsWay) {
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    const auto ranges = ranges_of(path_of({30, 90}, seed));
    const auto [low, high] = std::ranges::minmax(ranges, {}, &Range::alpha);
    EXPECT_LT(low.alpha, -15) << "seed " << seed;
    EXPECT_GT(high.alpha, 55) << "seed " << seed;
    const auto [lower, higher] = std::ranges::minmax(ranges, {}, &Range::beta);
    EXPECT_LT(lower.beta, 65) << "seed " << seed;
    EXPECT_GT(higher.beta, 175) << "seed " << seed;
  }
}

TEST(RangePath, RangesDependOnSeedAndNumberOnly) {
  std::set<double> alphas;
  for (std::uint64_t seed = 0; seed < 50; ++seed) alphas.insert(range_of(path_of({30, 90}, seed), 1).alpha);
  EXPECT_EQ(alphas.size(), 50u);
  for (std::uint64_t number = 0; number < 20; ++number) EXPECT_EQ(range_of(path_of({30, 90}, 5), number), range_of(path_of({30, 90}, 5), number));
}

// The span of the values is more than a double holds; there is one value.
TEST(RangePath, ValuesMayBeFarApartOrOne) {
  constexpr double kMost = std::numeric_limits<double>::max();
  for (std::uint64_t number = 0; number < 100; ++number) {
    const Range range = range_of({.start = {-1, 1}, .values = {-kMost, kMost}, .seed = 1}, number);
    EXPECT_LE(-kMost, range.alpha);
    EXPECT_LE(range.alpha, range.beta);
    EXPECT_LE(range.beta, kMost);
    EXPECT_EQ(range_of({.start = {-1, 9}, .values = {4, 4}, .seed = 1}, number), (Range{4, 4}));
  }
}

TEST(RangePath, ARestFollowsTenMoves) {
  EXPECT_EQ(rests_before(0), 0);
  EXPECT_EQ(rests_before(10), 0);
  EXPECT_EQ(rests_before(11), 1);
  EXPECT_EQ(rests_before(20), 1);
  EXPECT_EQ(rests_before(21), 2);
}

}  // namespace
}  // namespace intervale
