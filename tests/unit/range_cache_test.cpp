#include "server/serve/range_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/builder/find_relevant_updates.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

struct RangeCacheTest : ::testing::Test {
  std::shared_ptr<const IntervalVolume> volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  std::atomic<int> found = 0;
  RangeCache::Find find = [this](const RangeCache::Volume& of, const ShownRange& shown) {
    ++found;
    return find_relevant_updates(of, shown, false);
  };
  static ShownRanges shown(int number) { return {{{0, 0.01 * number}, Refine::boundary}}; }
};

TEST_F(RangeCacheTest, FindsEachRangeOnceForAllThreads) {
  RangeCache cache(find);
  std::vector<std::thread> threads;
  threads.reserve(4);
  std::atomic<int> same = 0;
  const auto first = cache.get(volume, shown(0));
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 40; ++i) (void)cache.get(volume, shown(i % 8));
      same += cache.get(volume, shown(0)) == first ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(found, 8);
  EXPECT_EQ(same, 4);
  EXPECT_EQ(cache.get(volume, {volume->description().whole()}).get(), &volume->relevant()) << "nothing has to be found";
  EXPECT_EQ(found, 8);
}

TEST_F(RangeCacheTest, KeepsWhatWasUsedLast) {
  const std::size_t bytes = find(volume, shown(1).front())->memory_bytes();
  found = 0;
  RangeCache cache(find, 2 * bytes + bytes / 2);
  (void)cache.get(volume, shown(1));
  (void)cache.get(volume, shown(2));
  (void)cache.get(volume, shown(1));
  (void)cache.get(volume, shown(3));  // drops 2
  EXPECT_EQ(found, 3);
  (void)cache.get(volume, shown(1));
  EXPECT_EQ(found, 3);
  (void)cache.get(volume, shown(2));
  EXPECT_EQ(found, 4);
}

TEST_F(RangeCacheTest, DropsWhatBelongsToDataSetsThatAreGone) {
  RangeCache cache(find);
  std::weak_ptr<const RelevantUpdates> old = cache.get(volume, shown(1));
  EXPECT_FALSE(old.expired());
  volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  (void)cache.get(volume, shown(1));
  EXPECT_TRUE(old.expired());
  EXPECT_EQ(found, 2);
}

TEST_F(RangeCacheTest, SeveralRangesAreUnitedOnceOfWhatEachNeeds) {
  RangeCache cache(find);
  const ShownRanges both = distinct({shown(2).front(), shown(1).front(), shown(2).front()});
  ASSERT_EQ(both.size(), 2u);
  const auto first = cache.get(volume, shown(1)), all = cache.get(volume, both);
  EXPECT_EQ(found, 2);
  EXPECT_EQ(all->shown(), both);
  EXPECT_EQ(cache.get(volume, both), all);
  EXPECT_EQ(cache.get(volume, shown(1)), first);
  EXPECT_EQ(found, 2);
}

TEST_F(RangeCacheTest, TriesAgainAfterAFailure) {
  bool fails = true;
  RangeCache cache([&](const RangeCache::Volume& of, const ShownRange& range) {
    if (std::exchange(fails, false)) throw std::runtime_error("no memory");
    return find(of, range);
  });
  EXPECT_THROW((void)cache.get(volume, shown(1)), std::runtime_error);
  EXPECT_NE(cache.get(volume, shown(1)), nullptr);
}

}  // namespace
}  // namespace intervale
