#include "server/serve/memory.h"

#include <gtest/gtest.h>

#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "common/selection/stream_plan.h"
#include "server/scratch/scratch_memory.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

using Holder = Memory::Holder;

TEST(Memory, IsWhatItsHoldersHave) {
  Memory memory(100);
  Memory::Share a(memory, Holder::sessions, 60);
  {
    Memory::Share b(memory, Holder::queues, 30);
    EXPECT_EQ(memory.bytes(), 90u);
    EXPECT_EQ(memory.room(), 10u);
    EXPECT_FALSE(memory.is_full());
    b.resize(41);
    EXPECT_TRUE(memory.is_full());
    EXPECT_EQ(memory.room(), 0u);
  }
  EXPECT_EQ(memory.bytes(Holder::queues), 0u);
  Memory::Share moved = std::move(a);
  EXPECT_EQ(memory.bytes(), 60u);
  moved.resize(7);
  EXPECT_EQ(memory.bytes(Holder::sessions), 7u);
  moved = Memory::Share(memory, Holder::ranges, 5);
  EXPECT_EQ(memory.bytes(), 5u);
}

TEST(Memory, WithoutALimitIsNeverFull) {
  Memory memory;
  const Memory::Share much(memory, Holder::datasets, std::uint64_t(1) << 50);
  EXPECT_FALSE(memory.is_full());
  EXPECT_EQ(memory.room(), ~std::uint64_t(0));
}

// What of data sets lies in a file is no matter for a limit of memory.
TEST(Memory, CountsOfDataMemoryNoMoreThanItsBudget) {
  constexpr std::uint64_t kData = 10'000'000;
  const auto data = ScratchMemory::open_for_data_sets("/var/tmp", kData);
  ASSERT_TRUE(data) << data.error().message;
  Memory memory(kData + 100, data->get());
  const Memory::Share much(memory, Holder::datasets, std::uint64_t(1) << 50);
  EXPECT_EQ(memory.bytes(Holder::datasets), kData);
  EXPECT_EQ(memory.room(), ~std::uint64_t(0));
  EXPECT_FALSE(memory.is_full());
  const Memory::Share more(memory, Holder::sessions, 101);
  EXPECT_TRUE(memory.is_full());
}

TEST(Memory, IsCountedByManyThreads) {
  Memory memory;
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&memory] {
      for (std::uint64_t i = 0; i < 10000; ++i) {
        Memory::Share share(memory, Holder::sessions, i);
        share.resize(2 * i);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(memory.bytes(), 0u);
}

TEST(Memory, ADataSetCountsUntilItsLastUserHasLeft) {
  Memory memory;
  auto volume = counted(memory, Holder::datasets, testing::build_shared(testing::gyroid({9, 9, 9}), {.range = {-1, 1}}));
  EXPECT_EQ(memory.bytes(Holder::datasets), volume->memory_bytes());
  auto user = volume;
  volume.reset();
  EXPECT_EQ(memory.bytes(Holder::datasets), user->memory_bytes());
  user.reset();
  EXPECT_EQ(memory.bytes(), 0u);
}

TEST(Memory, OfASessionGrowsWithWhatWasSent) {
  const auto volume = testing::build_shared(testing::gyroid({65, 65, 65}), {.range = {-0.5, 0.5}});
  StreamPlan plan(volume);
  const std::size_t before = plan.memory_bytes();
  plan.set_lod({});
  while (!plan.done()) {
    (void)plan.next(64 << 10);
    EXPECT_LE(plan.memory_bytes(), (16u << 10) + 5 * volume->set().bricks().size() + plan.sent() / 2) << plan.sent();
  }
  EXPECT_EQ(plan.sent(), volume->size());
  EXPECT_GE(plan.memory_bytes() - before, 2 * volume->set().supercubes());
}

TEST(Memory, OfTheProcessIsKnown) {
  const Memory memory;
  EXPECT_GT(resident_bytes(), std::uint64_t(1) << 20);
  EXPECT_GT(uncounted_bytes(memory), std::uint64_t(1) << 20);
}

// What cannot be returned is not asked for again and again.
TEST(TrimRule, IsDueOnceEnoughWasFreed) {
  constexpr std::uint64_t kSome = TrimRule::kWorthwhile;
  TrimRule rule;
  EXPECT_FALSE(rule.is_due(5 * kSome));
  EXPECT_FALSE(rule.is_due(4 * kSome));
  EXPECT_FALSE(rule.is_due(5 * kSome - 1));
  EXPECT_TRUE(rule.is_due(5 * kSome));
  rule.trimmed(5 * kSome);
  EXPECT_FALSE(rule.is_due(5 * kSome));
  EXPECT_TRUE(rule.is_due(6 * kSome));
}

}  // namespace
}  // namespace intervale
