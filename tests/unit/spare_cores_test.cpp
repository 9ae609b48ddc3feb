#include "server/serve/spare_cores.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stop_token>
#include <thread>
#include <vector>

#include "common/parallel/all_cores.h"
#include "server/scratch/scratch_memory.h"

namespace intervale {
namespace {

constexpr std::size_t kLarge = 1 << 20;  // bytes

struct SpareCoresTest : ::testing::Test {
  std::stop_source stop;
  FairScheduler scheduler{1};
};

TEST_F(SpareCoresTest, DoEachPieceOnce) {
  SpareCores cores(stop.get_token(), scheduler, SpareCores::Rests::while_sessions_wait, nullptr);
  for (const std::size_t count : {0U, 1U, 1000U}) {
    std::vector<std::atomic<int>> done(count);
    cores.all()(count, [&](std::size_t i) { ++done[i]; });
    for (const auto& times : done) EXPECT_EQ(times, 1);
  }
  EXPECT_GT(cores.take_time().count(), 0);
}

// On the thread that made it, that is up to that thread.
TEST_F(SpareCoresTest, OtherThreadsAllocateInTheDataMemory) {
  const auto memory = ScratchMemory::open_for_data_sets("/var/tmp", 16 << 20);
  ASSERT_TRUE(memory) << memory.error().message;
  SpareCores cores(stop.get_token(), scheduler, SpareCores::Rests::no, memory->get());
  const auto owner = std::this_thread::get_id();
  std::atomic<int> wrong{0};
  cores.all()(1000, [&](std::size_t) {
    const ScratchMemory* const expected = std::this_thread::get_id() == owner ? nullptr : memory->get();
    wrong += ScratchMemory::place_of(kLarge) != expected;
  });
  EXPECT_EQ(wrong, 0);
  on_all_cores(1000, [&](std::size_t) { wrong += ScratchMemory::place_of(kLarge) != nullptr; });
  EXPECT_EQ(wrong, 0) << "later work of the same threads lies elsewhere";
}

TEST_F(SpareCoresTest, BeginNoPieceOnceStopped) {
  SpareCores cores(stop.get_token(), scheduler, SpareCores::Rests::while_sessions_wait, nullptr);
  std::atomic<int> begun{0};
  const auto work = [&] {
    cores.all()(1000, [&](std::size_t) {
      ++begun;
      stop.request_stop();
    });
  };
  EXPECT_THROW(work(), Stopped);
  const int before = begun;
  EXPECT_THROW(work(), Stopped);
  EXPECT_EQ(begun, before);
}

}  // namespace
}  // namespace intervale
