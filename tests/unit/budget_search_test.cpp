#include "common/ivm/budget_search.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>

#include "common/ivm/refinement.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

constexpr std::array<testing::Dims, 4> kBoxes{{{17, 17, 17}, {12, 5, 7}, {33, 20, 9}, {65, 17, 33}}};

class BudgetSearches : public ::testing::TestWithParam<unsigned> {};

TEST_P(BudgetSearches, HoldTheFirstUpdatesInOrder) {
  std::mt19937 random(GetParam());
  const auto trial = testing::trial_of_seed(GetParam(), kBoxes);
  const auto shared = testing::build_shared(testing::stretched(trial.volume), trial.options);
  const IntervalVolume& volume = *shared;
  for (int i = 0; i < 12; ++i) {
    Lod lod = testing::random_lod(volume.description().grid, random);
    const auto order = in_order(volume, select(volume, lod), lod);
    lod.max_updates = i == 0 ? 0 : i == 1 ? order.size() : random() % (order.size() + order.size() / 4 + 2);
    BudgetSearch search(shared, {shared, &volume.relevant()}, lod);
    while (search.go_on()) {
    }
    SplitSet expected(volume.set());
    for (std::size_t k = 0; k < std::min<std::size_t>(order.size(), *lod.max_updates); ++k) expected.insert(volume.set().place(order[k]));
    EXPECT_TRUE(std::move(search).result() == expected) << "trial " << i << ": " << *lod.max_updates << " of " << order.size();
  }
}

INSTANTIATE_TEST_SUITE_P(Random, BudgetSearches, ::testing::Range(0u, 12u));

TEST(BudgetSearch, ComesInSlices) {
  const auto shared = testing::build_shared(testing::gyroid({65, 65, 65}), {{-0.5, 0.5}});
  const IntervalVolume& volume = *shared;
  Lod lod;
  lod.max_updates = volume.size() / 2;
  BudgetSearch search(shared, {shared, &volume.relevant()}, lod);
  unsigned slices = 1;
  std::size_t most = search.memory_bytes();
  while (search.go_on()) {
    ++slices;
    EXPECT_GE(search.memory_bytes(), most);
    most = search.memory_bytes();
  }
  EXPECT_GE(most, volume.size());  // at least two bytes for each update wanted
  EXPECT_GE(slices, volume.size() >> 15);
  EXPECT_EQ(std::move(search).result().count(), volume.size() / 2);
}

}  // namespace
}  // namespace intervale
