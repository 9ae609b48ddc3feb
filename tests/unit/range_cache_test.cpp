#include "server/serve/range_cache.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cmath>
#include <functional>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "common/parallel/all_cores.h"
#include "common/ranges/find_relevant_updates.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/needs.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

struct RangeCacheTest : ::testing::Test {
  Memory memory;
  std::shared_ptr<const IntervalVolume> volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  std::atomic<int> found = 0;
  RangeCache::Find find = [this](PartFinder& finder, const RangePart& part) {
    ++found;
    return finder.find(part);
  };
  // A range with one surface.
  static ShownRanges above(int number) { return {{{0.01 * number, kInf}, Refine::boundary}}; }
  static ShownRanges between(double low, double high) { return {{{low, high}, Refine::boundary}}; }
  FairScheduler scheduler{1};
  std::shared_ptr<FairScheduler::Account> payer = std::make_shared<FairScheduler::Account>();
  [[nodiscard]] RangeCache::Relevant get(RangeCache& cache, const RangeCache::Volume& of, const ShownRanges& shown,
                                         Distances distances = Distances::estimated) const {
    return cache.ask(of, shown, distances, payer, [] {})->result();
  }
  using OnReady = std::function<void()>;
  [[nodiscard]] std::shared_ptr<const RangeCache::Answer> measure(
      RangeCache& cache, const ShownRanges& shown, OnReady on_ready = [] {}) const {
    return cache.ask(volume, shown, Distances::measured, payer, std::move(on_ready));
  }
};

TEST_F(RangeCacheTest, FindsEachRangeOnceForAllThreads) {
  RangeCache cache(memory, scheduler, find);
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

// Parts and what they are put together to; also after the cache has dropped them, while somebody has them.
TEST_F(RangeCacheTest, WhatItHoldsAndWhatIsInUseCounts) {
  const auto counted = [this] { return memory.bytes(Memory::Holder::ranges); };
  auto cache = std::make_unique<RangeCache>(memory, scheduler, find, 1);
  auto one = get(*cache, volume, above(0));
  EXPECT_EQ(counted(), one->memory_bytes());
  auto several = get(*cache, volume, between(-0.5, 0.5));
  EXPECT_GE(counted(), one->memory_bytes() + several->memory_bytes());
  one.reset();
  (void)get(*cache, volume, {volume->description().whole()});
  cache.reset();
  const std::uint64_t before = counted();
  EXPECT_GE(before, several->memory_bytes()) << "with its parts";
  for (BrickIndex b{0}; b < volume->set().bricks().size(); ++b) (void)several->brick(b);
  EXPECT_GT(counted(), before + several->bound(BrickIndex(0)).updates) << "what is found by brick, of the range and of its parts";
  several.reset();
  EXPECT_EQ(counted(), 0u);
}

// Whoever drags one end of a range needs nothing new of the other.
TEST_F(RangeCacheTest, EachSurfaceIsFoundOnce) {
  RangeCache cache(memory, scheduler, find);
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
  const std::size_t bytes = PartFinder(*volume).find({above(1).front(), Distances::none})->memory_bytes();
  RangeCache cache(memory, scheduler, find, 2 * bytes + bytes / 2);
  (void)get(cache, volume, above(1));
  (void)get(cache, volume, above(2));
  (void)get(cache, volume, above(1));
  (void)get(cache, volume, above(3));  // drops 2
  EXPECT_EQ(found, 3);
  (void)get(cache, volume, above(1));
  EXPECT_EQ(found, 3);
  for (int i = 0; i < 1000 && found == 3; ++i) {  // once no thread has it any more
    (void)get(cache, volume, above(2));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(found, 4);
}

// However little may be kept: neither are both ends of the last range.
TEST_F(RangeCacheTest, WhatIsInUseIsNotFoundAgain) {
  RangeCache cache(memory, scheduler, find, 1);
  const auto in_use = get(cache, volume, above(1));
  for (const int other : {2, 3, 4, 5}) (void)get(cache, volume, above(other));
  EXPECT_EQ(found, 5);
  (void)get(cache, volume, above(1));
  EXPECT_EQ(found, 5);
  (void)get(cache, volume, between(-0.5, 0.5));
  EXPECT_EQ(found, 7);
  (void)get(cache, volume, between(-0.5, 0.5));
  EXPECT_EQ(found, 7);
}

TEST_F(RangeCacheTest, DropsWhatBelongsToDataSetsThatAreGone) {
  std::vector<std::weak_ptr<const RelevantUpdates>> parts;
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) {
    auto relevant = find(finder, part);
    if (parts.empty()) parts.push_back(relevant);
    return relevant;
  });
  (void)get(cache, volume, above(1));
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_FALSE(parts[0].expired());
  volume = testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}, .refine = Refine::uniform});
  // With the next part that is found, once no thread works on the data set any more.
  for (int i = 1; i < 1000 && !parts[0].expired(); ++i) {
    (void)get(cache, volume, above(i));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(parts[0].expired());
}

TEST_F(RangeCacheTest, SeveralRangesAreUnitedOnceOfWhatEachNeeds) {
  RangeCache cache(memory, scheduler, find);
  const ShownRanges both = distinct({above(2).front(), between(-1, 0.02).front(), above(2).front()});
  ASSERT_EQ(both.size(), 2u);
  const auto measured = [&](const ShownRanges& shown) { return get(cache, volume, shown, Distances::measured); };
  const auto first = measured(above(2)), all = measured(both);
  EXPECT_EQ(found, 3);
  EXPECT_EQ(all->shown(), both);
  EXPECT_TRUE(all->has_parts());
  EXPECT_EQ(testing::slots_of(*measured(both), *volume), testing::slots_of(*all, *volume));
  EXPECT_EQ(measured(above(2)), first);
  EXPECT_EQ(found, 3);
}

// Nothing is known of how far surfaces move inside, where a range is refined: what it needs together with another one is
// found anew.
TEST_F(RangeCacheTest, WhatIsFoundForSeveralRangesTogetherIsSharedWhileInUse) {
  RangeCache cache(memory, scheduler, find);
  const ShownRanges unlike = distinct({above(2).front(), {{-0.5, 0.5}, Refine::uniform}});
  const auto all = get(cache, volume, unlike);
  EXPECT_FALSE(all->has_parts());
  EXPECT_EQ(get(cache, volume, unlike), all);
}

// On the way from one value to the next a surface crosses the same edges, but at other places.
TEST_F(RangeCacheTest, EstimatesDoForAllRangesBetweenTwoKeys) {
  const ValueFormat& format = volume->description().format;
  const auto at = [&](ValueKey key, double share) { return std::lerp(format.value(key), format.value(key + 1), share); };
  RangeCache cache(memory, scheduler, find);
  const ShownRanges a = between(at(10, 0.25), at(60, 0)), b = between(at(10, 0.5), at(60, 0.75)), c = between(at(11, 0.25), at(60, 0.5));
  for (const ShownRanges& shown : {a, b, a}) EXPECT_EQ(get(cache, volume, shown)->shown(), shown);
  EXPECT_EQ(found, 2);
  (void)get(cache, volume, c);
  EXPECT_EQ(found, 3);
  (void)get(cache, volume, a, Distances::measured);
  (void)get(cache, volume, b, Distances::measured);
  EXPECT_EQ(found, 3 + 4);
}

// With few keys all surfaces between two of them are one, as lower ends and as upper ones.
TEST_F(RangeCacheTest, WithFewKeysWhatIsMeasuredDoesForAllRangesBetweenTwoKeys) {
  volume = testing::build_shared(testing::digits({9, 9, 9}, 1), {.range = {0, 9}, .refine = Refine::uniform});
  RangeCache cache(memory, scheduler, find);
  const auto measured = [&](double low, double high) { return get(cache, volume, between(low, high), Distances::measured); };
  const auto first = measured(2.25, 5), second = measured(3, 5.75), turned = measured(5.5, 8.5);
  EXPECT_EQ(found, 3) << "2 to 3, 5 to 6, and 8 to 9";
  EXPECT_EQ(first->shown(), between(2.25, 5));
  EXPECT_EQ(second->shown(), between(3, 5.75));
  EXPECT_TRUE(first->has_parts()) << "which are shared";
  EXPECT_EQ(testing::slots_of(*first, *volume), testing::slots_of(*second, *volume));
  const auto one = testing::error_to_distance_of(*first, *volume), other = testing::error_to_distance_of(*second, *volume);
  EXPECT_TRUE(std::ranges::equal(one, other, {}, &ErrorToDistance::code, &ErrorToDistance::code));
  (void)get(cache, volume, between(2.5, 8.25));
  EXPECT_EQ(found, 3) << "better known than by estimates";
  EXPECT_TRUE(measure(cache, between(2.75, 8.25))->is_soon());
}

// Its threads rest then, but they are not put off.
TEST_F(RangeCacheTest, MeasuresWhileSessionsWait) {
  boost::asio::io_context io;
  FairScheduler::Flow works(payer), waits(payer);
  for (auto* const flow : {&works, &waits})
    scheduler.async_acquire(*flow, FairScheduler::Priority::interactive, boost::asio::bind_executor(io, [](FairScheduler::Lane) {}));
  ASSERT_TRUE(scheduler.has_waiters());
  RangeCache cache(memory, scheduler, find);
  const auto measured = get(cache, volume, above(1), Distances::measured);
  const auto parts = parts_of(volume->description().format, above(1)[0], Distances::measured);
  PartFinder finder(*volume);
  const auto expected = finder.find(parts[0]);
  for (BrickIndex b{0}; b < volume->set().bricks().size(); ++b) {
    EXPECT_EQ(measured->bound(b).updates, expected->bound(b).updates);
    EXPECT_EQ(measured->bound(b).object_error, expected->bound(b).object_error);
  }
  EXPECT_TRUE(scheduler.has_waiters());
  scheduler.clear();
}

TEST_F(RangeCacheTest, StopsWhileItMeasures) {
  std::binary_semaphore began(0);
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) -> RangeCache::Relevant {
    began.release();
    for (;;) (void)finder.find(part);
  });
  const auto request = measure(cache, above(1));
  began.acquire();
  cache.stop();
  EXPECT_THROW((void)request->result(), Stopped);
}

// One surface is done when its last requests are: those of others that have it need not wait for their turn.
TEST_F(RangeCacheTest, HandsASurfaceToAllThatWaitForIt) {
  std::counting_semaphore<> may_go(0), began(0), ready(0);
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) {
    began.release();
    may_go.acquire();
    return find(finder, part);
  });
  const auto first = measure(cache, between(-0.5, 0.5), [&] { ready.release(); });
  began.acquire();
  const auto second = measure(cache, {{{-0.5, kInf}, Refine::boundary}}, [&] { ready.release(); });
  may_go.release();
  ready.acquire();
  EXPECT_TRUE(second->is_ready());
  EXPECT_FALSE(first->is_ready());
  may_go.release();
  ready.acquire();
  EXPECT_TRUE(first->is_ready());
  EXPECT_EQ(found, 2);
}

TEST_F(RangeCacheTest, TriesAgainAfterAFailure) {
  bool fails = true;
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) {
    if (std::exchange(fails, false)) throw std::runtime_error("no memory");
    return find(finder, part);
  });
  EXPECT_THROW((void)get(cache, volume, above(1)), std::runtime_error);
  EXPECT_NE(get(cache, volume, above(1)), nullptr);
  fails = true;
  std::counting_semaphore<> ready(0);
  const auto failed = measure(cache, above(1), [&] { ready.release(); });
  ready.acquire();
  EXPECT_THROW((void)failed->result(), std::runtime_error);
}

// A request that is released while another is measured is not measured; of the others the newest is the first.
TEST_F(RangeCacheTest, MeasuresTheNewestThatIsStillWanted) {
  std::counting_semaphore<> may_go(0), began(0);
  std::vector<double> measured;
  const auto whole = ShownRanges{volume->description().whole()};
  std::counting_semaphore<> ready(0);
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) {
    measured.push_back(part.shown.range.alpha);
    began.release();
    may_go.acquire();
    return find(finder, part);
  });
  const auto request = [&](int number) { return measure(cache, above(number), [&] { ready.release(); }); };
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
  EXPECT_EQ(first->result(), get(cache, volume, above(1), Distances::measured));
  EXPECT_TRUE(request(2)->is_ready()) << "it is known";
  EXPECT_EQ(measure(cache, whole)->result().get(), &volume->relevant());
}

// However many requests another account has.
TEST_F(RangeCacheTest, WhoeverSpentLessIsServedFirst) {
  std::counting_semaphore<> may_go(0), began(0), ready(0);
  std::vector<double> measured;
  RangeCache cache(memory, scheduler, [&](PartFinder& finder, const RangePart& part) {
    measured.push_back(part.shown.range.alpha);
    began.release();
    may_go.acquire();
    return find(finder, part);
  });
  scheduler.charge(*payer, std::chrono::seconds(1));
  const auto on_ready = [&] { ready.release(); };
  const auto first = measure(cache, above(1), on_ready);
  began.acquire();
  const auto other = cache.ask(volume, above(2), Distances::measured, std::make_shared<FairScheduler::Account>(), on_ready);
  const auto third = measure(cache, above(3), on_ready);
  may_go.release(3);
  for (int i = 0; i < 3; ++i) ready.acquire();
  EXPECT_EQ(measured, (std::vector{0.01, 0.02, 0.03}));
}

}  // namespace
}  // namespace intervale
