// Ranks of a camera that moves; those of one that rests: ranking_test.cpp.
#include <gtest/gtest.h>

#include <random>

#include "common/ivm/ranking.h"
#include "tests/support/cameras.h"
#include "tests/support/ranks.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

using testing::for_each_rank;

class RanksAhead : public ::testing::TestWithParam<unsigned> {
 protected:
  IntervalVolume volume_ = testing::ranking_volume(GetParam());
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(RanksAhead, WhereTheCameraGoesChangesRanksButNotWhatIsWanted) {
  std::size_t moved = 0;
  for (unsigned trial = 0; trial < testing::cases(40); ++trial) {
    const Grid& g = volume_.description().grid;
    const Lod lod = testing::random_lod(g, random_);
    const Camera ahead = testing::random_camera(g, random_);
    const Ranking resting(volume_, lod), moving(volume_, volume_.relevant(), lod, nullptr, &ahead);
    for_each_rank(volume_, moving, [&](const Place& p, Ranking::Rank rank) {
      const Ranking::Rank without = testing::rank_of(volume_, resting, p);
      ASSERT_EQ(rank == 0, without == 0) << "trial " << trial;
      if (!lod.camera) {
        ASSERT_EQ(rank, without) << "without a camera there is no other";
      }
      moved += rank != without;
    });
  }
  if (GetParam() == 0) {
    EXPECT_GT(moved, 0u);
  }
}

TEST_P(RanksAhead, ACameraThatGoesNowhereRanksAsOneThatRests) {
  for (unsigned trial = 0; trial < testing::cases(40); ++trial) {
    const Lod lod = testing::random_lod(volume_.description().grid, random_);
    if (!lod.camera) continue;
    const Ranking resting(volume_, lod), moving(volume_, volume_.relevant(), lod, nullptr, &*lod.camera);
    for_each_rank(volume_, moving,
                  [&](const Place& p, Ranking::Rank rank) { ASSERT_EQ(rank, testing::rank_of(volume_, resting, p)) << "trial " << trial; });
  }
}

INSTANTIATE_TEST_SUITE_P(Random, RanksAhead, ::testing::Range(0u, 10u));

}  // namespace
}  // namespace intervale
