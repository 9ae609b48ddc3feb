#include "server/serve/range_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "server/builder/find_relevant_updates.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

struct RangeCacheTest : ::testing::Test {
  std::shared_ptr<const IntervalVolume> volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  std::atomic<int> found = 0;
  RangeCache::Find find = [this](const IntervalVolume& of, const ShownRange& part, Distances distances) {
    ++found;
    return find_relevant_part(of, part, distances);
  };
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  // A range with one surface.
  static ShownRanges above(int number) { return {{{0.01 * number, kInfinity}, Refine::boundary}}; }
  static ShownRanges between(double low, double high) { return {{{low, high}, Refine::boundary}}; }
  [[nodiscard]] static RangeCache::Relevant get(RangeCache& cache, const RangeCache::Volume& of, const ShownRanges& shown) {
    return cache.get(of, shown, Distances::estimated);
  }
};

TEST_F(RangeCacheTest, FindsEachRangeOnceForAllThreads) {
  RangeCache cache(find);
  std::vector<std::thread> threads;
  threads.reserve(4);
  std::atomic<int> same = 0;
  const auto first = get(cache, volume, above(0));
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 40; ++i) (void)get(cache, volume, above(i % 8));
      same += get(cache, volume, above(0)) == first ? 1 : 0;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(found, 8);
  EXPECT_EQ(same, 4);
  EXPECT_EQ(get(cache, volume, {volume->description().whole()}).get(), &volume->relevant()) << "nothing has to be found";
  EXPECT_EQ(found, 8);
}

// Whoever drags one end of a range needs nothing new of the other.
TEST_F(RangeCacheTest, EachSurfaceIsFoundOnce) {
  RangeCache cache(find);
  const auto first = get(cache, volume, between(-0.5, 0.5));
  EXPECT_EQ(found, 2);
  (void)get(cache, volume, between(-0.5, 0.25));
  EXPECT_EQ(found, 3);
  (void)get(cache, volume, between(0, 0.25));
  EXPECT_EQ(found, 4);
  (void)get(cache, volume, {{{-0.5, 0.25}, Refine::uniform}});
  EXPECT_EQ(found, 5) << "the inside";
  (void)get(cache, volume, between(-0.5, 0.5));
  EXPECT_EQ(first->shown(), between(-0.5, 0.5));
  EXPECT_EQ(found, 5);
}

TEST_F(RangeCacheTest, KeepsWhatWasUsedLast) {
  const std::size_t bytes = find(*volume, above(1).front(), Distances::none)->memory_bytes();
  found = 0;
  RangeCache cache(find, 2 * bytes + bytes / 2);
  (void)get(cache, volume, above(1));
  (void)get(cache, volume, above(2));
  (void)get(cache, volume, above(1));
  (void)get(cache, volume, above(3));  // drops 2
  EXPECT_EQ(found, 3);
  (void)get(cache, volume, above(1));
  EXPECT_EQ(found, 3);
  (void)get(cache, volume, above(2));
  EXPECT_EQ(found, 4);
}

TEST_F(RangeCacheTest, DropsWhatBelongsToDataSetsThatAreGone) {
  RangeCache cache(find);
  std::weak_ptr<const RelevantUpdates> old = get(cache, volume, above(1));
  EXPECT_FALSE(old.expired());
  volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  (void)get(cache, volume, above(1));
  EXPECT_TRUE(old.expired());
  EXPECT_EQ(found, 2);
}

TEST_F(RangeCacheTest, SeveralRangesAreUnitedOnceOfWhatEachNeeds) {
  RangeCache cache(find);
  const ShownRanges both = distinct({above(2).front(), between(-1, 0.02).front(), above(2).front()});
  ASSERT_EQ(both.size(), 2u);
  const auto measured = [&](const ShownRanges& shown) { return cache.get(volume, shown, Distances::measured); };
  const auto first = measured(above(2)), all = measured(both);
  EXPECT_EQ(found, 3);
  EXPECT_EQ(all->shown(), both);
  EXPECT_EQ(measured(both), all);
  EXPECT_EQ(measured(above(2)), first);
  EXPECT_EQ(found, 3);
}

// On the way from one value to the next a surface crosses the same edges, but at other places.
TEST_F(RangeCacheTest, EstimatesDoForAllRangesBetweenTwoKeys) {
  const ValueFormat& format = volume->description().format;
  const auto at = [&](ValueKey key, double share) { return std::lerp(format.value(key), format.value(key + 1), share); };
  RangeCache cache(find);
  const ShownRanges a = between(at(10, 0.25), at(60, 0)), b = between(at(10, 0.5), at(60, 0.75)), c = between(at(11, 0.25), at(60, 0.5));
  for (const ShownRanges& shown : {a, b, a}) EXPECT_EQ(get(cache, volume, shown)->shown(), shown);
  EXPECT_EQ(found, 2);
  (void)get(cache, volume, c);
  EXPECT_EQ(found, 3);
  (void)cache.get(volume, a, Distances::measured);
  (void)cache.get(volume, b, Distances::measured);
  EXPECT_EQ(found, 3 + 4);
}

TEST_F(RangeCacheTest, TriesAgainAfterAFailure) {
  bool fails = true;
  RangeCache cache([&](const IntervalVolume& of, const ShownRange& part, Distances distances) {
    if (std::exchange(fails, false)) throw std::runtime_error("no memory");
    return find(of, part, distances);
  });
  EXPECT_THROW((void)get(cache, volume, above(1)), std::runtime_error);
  EXPECT_NE(get(cache, volume, above(1)), nullptr);
  fails = true;
  std::counting_semaphore<> ready(0);
  const auto failed = cache.measure(volume, above(1), [&] { ready.release(); });
  ready.acquire();
  EXPECT_THROW((void)failed->result(), std::runtime_error);
}

// A request that is released while another is measured is not measured; of the others the newest is the first.
TEST_F(RangeCacheTest, MeasuresTheNewestThatIsStillWanted) {
  std::counting_semaphore<> may_go(0), began(0);
  std::vector<double> measured;
  const auto whole = ShownRanges{volume->description().whole()};
  std::counting_semaphore<> ready(0);
  RangeCache cache([&](const IntervalVolume& of, const ShownRange& part, Distances distances) {
    measured.push_back(part.range.alpha);
    began.release();
    may_go.acquire();
    return find(of, part, distances);
  });
  const auto request = [&](int number) { return cache.measure(volume, above(number), [&] { ready.release(); }); };
  const auto first = request(1);
  began.acquire();
  const auto second = request(2);
  auto third = request(3);
  const auto fourth = request(4);
  third.reset();
  EXPECT_FALSE(first->is_ready() || second->is_ready());
  may_go.release(3);
  for (int i = 0; i < 3; ++i) ready.acquire();
  EXPECT_EQ(measured, (std::vector{0.01, 0.04, 0.02}));
  EXPECT_EQ(first->result(), cache.get(volume, above(1), Distances::measured));
  EXPECT_TRUE(request(2)->is_ready()) << "it is known";
  EXPECT_EQ(cache.measure(volume, whole, [] {})->result().get(), &volume->relevant());
}

}  // namespace
}  // namespace intervale
