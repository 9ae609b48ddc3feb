#include "common/selection/packed_splits.h"

#include <gtest/gtest.h>

#include <random>

#include "common/ivm/refinement.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/split_sets.h"

namespace intervale {
namespace {

constexpr std::array<testing::Dims, 4> kPackedBoxes{{{9, 9, 9}, {40, 33, 35}, {12, 5, 7}, {2, 9, 20}}};

class Packed : public ::testing::TestWithParam<unsigned> {
 protected:
  void expect_same(const SplitSet& splits) const { EXPECT_EQ(PackedSplits(volume_.set(), splits).unpack(volume_.set()), splits); }
  const IntervalVolume volume_ = [] {
    const auto trial = testing::trial_of_seed(GetParam(), kPackedBoxes);
    return testing::build(trial.volume, trial.options);
  }();
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(Packed, IsTheSameSetAgain) {
  expect_same(SplitSet(volume_.size()));
  expect_same(testing::all_of(volume_.set()));
  for (int trial = 0; trial < 10; ++trial) {
    expect_same(select(volume_, Lod{.error_percent = double(random_() % 60)}));
    SplitSet some(volume_.size());  // of any, not closed under parents, also of few that were there once
    const auto share = 1 + random_() % 40;
    for (UpdateIndex i{0}; i < volume_.size(); ++i) {
      if (random_() % share == 0) some.insert(i);
    }
    expect_same(some);
    for (UpdateIndex i{0}; i < volume_.size(); ++i) {
      if (random_() % 3 != 0) some.erase(i);
    }
    expect_same(some);
  }
}

TEST_P(Packed, NothingTakesNothing) {
  SplitSet none(volume_.size());
  none.insert(UpdateIndex(0));
  none.erase(UpdateIndex(0));
  EXPECT_EQ(PackedSplits(volume_.set(), none).memory_bytes(), 0u);
  EXPECT_EQ(PackedSplits().unpack(volume_.set()), none);
}

TEST(PackedSplits, TakeLessThanTheSet) {
  const IntervalVolume volume = testing::build(testing::gyroid({40, 33, 35}), {.range = {-0.5, 0.5}});
  const SplitSet some = select(volume, Lod{.error_percent = 10});
  ASSERT_GT(some.count(), 10000u);
  EXPECT_LT(PackedSplits(volume.set(), some).memory_bytes(), some.memory_bytes() / 2);
}

INSTANTIATE_TEST_SUITE_P(Random, Packed, ::testing::Range(0u, 8u));

}  // namespace
}  // namespace intervale
