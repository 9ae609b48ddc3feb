// Bounds that are found for many bricks at once: never too low, and seldom much too high.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "common/ivm/ranking.h"
#include "common/view/screen_error.h"
#include "tests/support/cameras.h"
#include "tests/support/ranks.h"

namespace intervale {
namespace {

class BrickBounds : public ::testing::TestWithParam<unsigned> {
 protected:
  void expect_bounds(const Ranking& ranking) {
    constexpr std::size_t kBlock = Ranking::BlockBounds::kBlock;
    const Ranking::BlockBounds bounds(ranking, Ranking::BlockBounds::Of::bricks);
    const RelevantUpdates& relevant = volume_.relevant();
    const std::size_t bricks = volume_.set().bricks().size();
    std::vector<Ranking::Rank> ranks;
    for (std::size_t block = 0; block * kBlock < bricks; ++block) {
      const std::size_t count = std::min(kBlock, bricks - block * kBlock);
      std::array<Ranking::Left, kBlock> all, some, hardly_wanted, steep;
      for (std::size_t k = 0; k < count; ++k) {
        const RelevantUpdates::Bound bound = relevant.bound(BrickIndex(std::uint32_t(block * kBlock + k)));
        all[k] = {bound.error_step, bound.object_error, bound.slope};
        const unsigned step = unsigned(random_()) % (bound.error_step + 1U), slope = unsigned(random_()) % (bound.slope + 1U);
        some[k] = {step, bound.object_error / 2, slope};
        hardly_wanted[k] = {step, bound.object_error, slope, 0, unsigned(random_()) % (bound.slope + 1U)};
        steep[k] = {step, bound.object_error, slope};
      }
      const std::uint32_t which = (std::uint32_t(1) << count) - 1;
      const auto of_all = bounds(block, which, all), of_some = bounds(block, which, some);
      const auto of_hardly_wanted = bounds(block, which, hardly_wanted), of_steep = bounds(block, which, steep);
      for (std::size_t k = 0; k < kBlock; ++k) {
        if (k >= count) {
          ASSERT_EQ(of_all.rank[k], 0);
          continue;
        }
        ranks.push_back(of_all.rank[k]);
        const Ranking::Brick brick = ranking.of_brick(BrickIndex(std::uint32_t(block * kBlock + k)));
        if (ranking.has_camera()) {
          ASSERT_GE(of_all.pixels[k], brick.pixels(all[k].object_error));
        }
        ASSERT_LE(of_some.rank[k], of_all.rank[k]);
        if (bounds.is_exact()) {
          ASSERT_EQ(of_some.rank[k], brick.bound(some[k]));
        }
        // Steep ones that are hardly wanted come last; those that may be wanted more count.
        ASSERT_EQ(of_hardly_wanted.rank[k], of_steep.rank[k]);
        if (ranking.has_camera()) {
          Ranking::Left wanted = hardly_wanted[k];
          wanted.limit = 2 * Ranking::Left::kHardly * brick.unwanted();
          steep[k].slope = std::max(wanted.slope, wanted.slope_below);
          ASSERT_EQ(brick.bound(wanted), brick.bound(steep[k]));
        }
      }
    }
    testing::for_each_rank(volume_, ranking, [&](const Place& p, Ranking::Rank rank) { ASSERT_LE(rank, ranks[p.brick]); });
  }
  IntervalVolume volume_ = testing::ranking_volume(GetParam());
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(BrickBounds, AreNeverTooLow) {
  for (int trial = 0; trial < 60; ++trial) {
    const Grid& g = volume_.description().grid;
    const Lod lod = testing::random_lod(g, random_);
    const auto map = testing::random_map(lod, g, random_);
    const auto ahead = testing::random_ahead(lod, g, random_);
    expect_bounds(Ranking(volume_, volume_.relevant(), lod, map ? &*map : nullptr, ahead ? &*ahead : nullptr));
  }
}

TEST_P(BrickBounds, AreNeverTooLowWhateverTheCamera) {
  Lod lod;
  lod.camera = testing::random_camera(volume_.description().grid, random_);
  for (const double away : {1.0, 1e6, 1e20, 1e100}) {
    for (double& x : lod.camera->eye) x *= away;
    for (const double fov : {1e-306, 1e-100, 1e-37, 1e-30, 30.0, 179.999999}) {
      lod.camera->fov = fov;
      if (check_lod(lod)) expect_bounds(Ranking(volume_, lod));
    }
  }
}

// Of bricks of several scales; more of them than a block of bounds holds.
TEST_P(BrickBounds, OfRunsAreNoLowerThanThoseOfTheirBricks) {
  constexpr std::size_t kRun = RelevantUpdates::kRun, kBlock = Ranking::BlockBounds::kBlock;
  const auto trial = testing::trial_of_seed(GetParam(), std::array<testing::Dims, 2>{{{9000, 3, 2}, {150, 5, 140}}});
  const IntervalVolume volume = testing::build(GetParam() % 3 != 0 ? testing::stretched(trial.volume) : trial.volume, trial.options);
  const RelevantUpdates& relevant = volume.relevant();
  const std::size_t bricks = volume.set().bricks().size();
  std::vector<RelevantUpdates::RunBound> runs((bricks + kRun - 1) / kRun);
  for (std::size_t b = 0; b < bricks; ++b) runs[b / kRun].add(relevant.bound(BrickIndex(std::uint32_t(b))));
  ASSERT_GT(runs.size(), 2u);
  for (int trials = 0; trials < 60; ++trials) {
    const Lod lod = testing::random_lod(volume.description().grid, random_);
    const auto ahead = testing::random_ahead(lod, volume.description().grid, random_);
    const Ranking ranking(volume, volume.relevant(), lod, nullptr, ahead ? &*ahead : nullptr);
    const Ranking::BlockBounds bounds(ranking, Ranking::BlockBounds::Of::runs), of_bricks(ranking, Ranking::BlockBounds::Of::bricks);
    for (std::size_t begin = 0; begin < runs.size(); begin += kBlock) {
      std::array<Ranking::Left, kBlock> left{};
      std::uint32_t which = 0;
      for (std::size_t k = 0; k < std::min(kBlock, runs.size() - begin); ++k) {
        const RelevantUpdates::RunBound known = relevant.run_bound(begin + k);
        ASSERT_EQ(known.updates, runs[begin + k].updates);
        ASSERT_EQ(known.error_step, runs[begin + k].error_step);
        ASSERT_EQ(known.slope, runs[begin + k].slope);
        ASSERT_EQ(known.object_error, runs[begin + k].object_error);
        left[k] = {known.error_step, known.object_error, known.slope};
        which |= std::uint32_t(1) << k;
      }
      const auto bound = bounds(begin / kBlock, which, left);
      for (const std::size_t k : set_bits<std::size_t>(which)) {
        const std::size_t first = (begin + k) * kRun, end = std::min(bricks, first + kRun);
        for (std::size_t b = first; b < end; ++b) {
          const RelevantUpdates::Bound all = relevant.bound(BrickIndex(std::uint32_t(b)));
          std::array<Ranking::Left, kBlock> of_brick{};
          of_brick[b % kBlock] = {all.error_step, all.object_error, all.slope};
          const auto brick = of_bricks(b / kBlock, std::uint32_t(1) << b % kBlock, of_brick);
          const Ranking::Brick exact = ranking.of_brick(BrickIndex(std::uint32_t(b)));
          if (ranking.has_camera()) {
            ASSERT_GE(bound.pixels[k], exact.pixels(all.object_error));
          }
          ASSERT_TRUE(bound.rank[k] != 0 || exact.bound() == 0);
          // Brick::bound() is higher for bricks that are near, and beside the picture. Both are rounded up.
          if (of_bricks.is_exact() && ranking.has_camera()) continue;
          ASSERT_GE(bound.rank[k] + 1, brick.rank[b % kBlock]);
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, BrickBounds, ::testing::Range(0u, 10u));

// Regions of grids of any unit, turned and sheared.
TEST(RegionBounds, AreThoseOfEachRegion) {
  std::mt19937 random(1);
  std::size_t seen = 0, beside = 0;
  for (int trial = 0; trial < 300; ++trial) {
    Grid grid{{40, 30, 20}, Affine::of({0.5, 1, 3}, {-4, 100, 7})};
    const double unit = std::pow(10.0, testing::uniform(random, -25, 25));
    for (double& number : grid.affine.rows) number = unit * (number + testing::uniform(random, -0.2, 0.2) * (trial % 2));
    const Camera camera = testing::random_camera(grid, random);
    const ScreenError view(camera, grid);
    std::vector<ScreenError::Region> each(37);
    for (ScreenError::Region& region : each) {
      for (std::size_t k = 0; k < 3; ++k) {
        const double a = testing::uniform(random, 0, grid.dims[k] - 1), b = a + testing::uniform(random, -2, 2);
        const double low = std::max(0.0, std::min(a, b)), high = std::min(grid.dims[k] - 1.0, std::max(a, b));
        region.middle[k] = (low + high) / 2;
        region.reach[k] = (high - low) / 2;
      }
    }
    const ScreenError::Regions regions(grid, each);
    const ScreenError::RegionBounds bounds_of(view, regions);
    constexpr std::size_t kBlock = ScreenError::Regions::kBlock;
    for (std::size_t i = 0; i < each.size(); ++i) {
      const auto bounds = bounds_of(i / kBlock);
      const double pixels = std::min(view.pixels_per_unit(each[i]), 0x1p100), share = view.seen_share(each[i]);
      const auto bound = double(bounds.pixels[i % kBlock]);
      ASSERT_GE(bound, pixels * (1 - 1e-7)) << "trial " << trial;
      ASSERT_GE(double(bounds.share[i % kBlock]), share * (1 - 1e-6)) << "trial " << trial;
      if (view.is_near(each[i])) continue;
      if (share > 1e-5) {
        ++seen;
        EXPECT_LE(bound, pixels * 1.001) << "trial " << trial;
      }
      beside += share <= 1e-6 && bounds.share[i % kBlock] < 1;
    }
  }
  EXPECT_GT(seen, 500u);
  EXPECT_GT(beside, 500u);
}

}  // namespace
}  // namespace intervale
