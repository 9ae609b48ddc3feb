#include "server/serve/fair_scheduler.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace intervale {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;
using Priority = FairScheduler::Priority;

class FairSchedulerTest : public ::testing::Test {
 protected:
  void acquire(int session, Priority priority) {
    scheduler_.async_acquire(sessions_[session], priority, asio::bind_executor(io_, [this, session] { running_ += char('a' + session); }));
  }
  void release(int session, Priority priority, int ms) { scheduler_.release(sessions_[session], priority, milliseconds(ms)); }
  // Runs the handlers; returns the sessions that were assigned a worker since the last call.
  std::string started() {
    io_.restart();
    io_.poll();
    return std::exchange(running_, "");
  }

  std::array<FairScheduler::Flow, 10> sessions_;
  asio::io_context io_;
  FairScheduler scheduler_{2};
  std::string running_;
};

TEST_F(FairSchedulerTest, StartsNoMoreWorkThanThereAreWorkers) {
  for (const int session : {0, 1}) acquire(session, Priority::bulk);
  EXPECT_FALSE(scheduler_.has_waiters());
  for (const int session : {2, 3}) acquire(session, Priority::bulk);
  EXPECT_TRUE(scheduler_.has_waiters());
  EXPECT_EQ(started(), "ab");
  EXPECT_EQ(started(), "");
  release(0, Priority::bulk, 1);
  EXPECT_EQ(started(), "c");
  release(1, Priority::bulk, 1);
  EXPECT_EQ(started(), "d");
  EXPECT_FALSE(scheduler_.has_waiters());
  for (const int session : {2, 3}) release(session, Priority::bulk, 1);
  acquire(4, Priority::bulk);
  EXPECT_EQ(started(), "e") << "a worker was idle";
}

TEST_F(FairSchedulerTest, CompletesOnlyAfterAsyncAcquireReturns) {
  bool entered = false;
  scheduler_.async_acquire(sessions_[0], Priority::interactive, asio::bind_executor(io_, [&] { entered = true; }));
  EXPECT_FALSE(entered);
  io_.poll();
  EXPECT_TRUE(entered);
}

TEST_F(FairSchedulerTest, InteractiveWorkGoesFirst) {
  for (const int session : {0, 1, 2, 3}) acquire(session, Priority::bulk);
  for (const int session : {4, 5}) acquire(session, Priority::interactive);
  EXPECT_EQ(started(), "ab");
  std::string order;
  for (int i = 0; i < 4; ++i) {
    release(i, Priority::bulk, 0);
    order += started();
  }
  EXPECT_EQ(order, "efcd");
}

TEST_F(FairSchedulerTest, PromotedWorkGoesBehindWaitingInteractiveWork) {
  for (const int session : {0, 1, 2, 3}) acquire(session, Priority::bulk);
  acquire(4, Priority::interactive);
  scheduler_.promote(sessions_[3]);
  scheduler_.promote(sessions_[3]);
  scheduler_.promote(sessions_[0]);  // running
  scheduler_.promote(sessions_[9]);  // not waiting
  EXPECT_EQ(started(), "ab");
  std::string order;
  for (int i = 0; i < 3; ++i) {
    release(i, Priority::bulk, 0);
    order += started();
  }
  EXPECT_EQ(order, "edc");
}

// The share of the time that each session gets, if each requests the one worker again as soon as it has released it.
struct Load {
  Priority priority;
  double ms;
};
std::vector<double> shares(const std::vector<Load>& loads) {
  constexpr int kRounds = 20000;
  asio::io_context io;
  std::vector<FairScheduler::Flow> sessions(loads.size());
  FairScheduler scheduler(1);
  std::vector<std::size_t> inside;
  const auto acquire = [&](std::size_t session) {
    scheduler.async_acquire(sessions[session], loads[session].priority, asio::bind_executor(io, [&inside, session] { inside.push_back(session); }));
  };
  for (std::size_t session = 0; session < loads.size(); ++session) acquire(session);
  std::vector<double> times(loads.size());
  double all = 0;
  for (int i = 0; i < kRounds; ++i) {
    io.restart();
    io.poll();
    EXPECT_EQ(inside.size(), 1u);
    const std::size_t session = inside.back();
    inside.clear();
    const auto& [priority, ms] = loads[session];
    times[session] += ms;
    all += ms;
    acquire(session);
    scheduler.release(sessions[session], priority, std::chrono::duration_cast<FairScheduler::Time>(std::chrono::duration<double, std::milli>(ms)));
  }
  io.restart();
  io.poll();  // the last one
  for (double& time : times) time /= all;
  return times;
}

// Interactive work gets seven eighths.
TEST(FairScheduler, BulkWorkGetsAnEighthOfTheTime) {
  for (const double wanted : {0.5, 3.0}) {
    const auto times = shares({{Priority::bulk, wanted}, {Priority::bulk, wanted}, {Priority::interactive, 1}, {Priority::interactive, 1}});
    EXPECT_NEAR(times[0] + times[1], 0.125, 0.02) << wanted;
  }
}

TEST(FairScheduler, LongWorkGetsNoMoreTimeThanShortWork) {
  const auto times = shares({{Priority::interactive, 200}, {Priority::interactive, 1}, {Priority::interactive, 5}, {Priority::interactive, 50}});
  for (const double time : times) EXPECT_NEAR(time, 0.25, 0.02);
}

TEST_F(FairSchedulerTest, NewFlowsGoBeforeFlowsThatHadMoreTime) {
  for (const int session : {0, 1}) acquire(session, Priority::interactive);
  EXPECT_EQ(started(), "ab");
  acquire(0, Priority::interactive);  // for a new view, while the last one is computed
  release(0, Priority::interactive, 20);
  EXPECT_EQ(started(), "a") << "no other session waits";
  for (const int session : {0, 2, 3}) acquire(session, Priority::interactive);
  std::string order;
  release(1, Priority::interactive, 1);
  order += started();
  release(2, Priority::interactive, 1);
  order += started();
  release(3, Priority::interactive, 1);
  order += started();
  EXPECT_EQ(order, "cda");
}

// One of two workers is for short work, once it is known which sessions have long work.
TEST_F(FairSchedulerTest, LongWorkLeavesAWorkerToOthers) {
  for (const int session : {0, 1}) acquire(session, Priority::interactive);
  for (const int session : {0, 1}) release(session, Priority::interactive, 200);
  EXPECT_EQ(started(), "ab");
  for (const int session : {0, 1}) acquire(session, Priority::interactive);
  EXPECT_EQ(started(), "a");
  EXPECT_TRUE(scheduler_.has_waiters());
  acquire(2, Priority::interactive);
  EXPECT_EQ(started(), "c") << "the worker was kept";
  release(2, Priority::interactive, 1);
  EXPECT_EQ(started(), "");
  acquire(3, Priority::bulk);
  EXPECT_EQ(started(), "d");
  release(3, Priority::bulk, 1);
  EXPECT_EQ(started(), "");
  release(0, Priority::interactive, 200);
  EXPECT_EQ(started(), "b") << "long work does not starve";
  release(1, Priority::interactive, 1);
  acquire(1, Priority::interactive);
  acquire(0, Priority::interactive);
  EXPECT_EQ(started(), "ba") << "a session whose last work was short has no long work any more";
}

TEST_F(FairSchedulerTest, ClearDestroysAllWaitingHandlers) {
  const auto token = std::make_shared<int>(1);
  for (const int session : {0, 1}) acquire(session, Priority::bulk);
  for (const Priority priority : {Priority::bulk, Priority::interactive})
    scheduler_.async_acquire(sessions_[7], priority, asio::bind_executor(io_, [token] {}));
  EXPECT_EQ(token.use_count(), 3);
  scheduler_.clear();
  EXPECT_EQ(token.use_count(), 1);
  EXPECT_FALSE(scheduler_.has_waiters());
  scheduler_.promote(sessions_[7]);
}

TEST(FairScheduler, RunsNoMoreWorkThanThereAreWorkersOnAnyNumberOfThreads) {
  asio::io_context io;
  FairScheduler scheduler(2);
  std::atomic<int> inside{0}, most{0}, done{0};
  constexpr int kSessions = 50, kRounds = 100;
  std::array<FairScheduler::Flow, kSessions> sessions;
  std::function<void(int, int)> go = [&](int session, int round) {
    if (round == kRounds) return;
    const Priority priority = (session + round) % 3 == 0 ? Priority::interactive : Priority::bulk;
    scheduler.async_acquire(sessions[std::size_t(session)], priority, asio::bind_executor(io, [&, session, round, priority] {
                              const int now = ++inside;
                              for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
                              }
                              scheduler.promote(sessions[std::size_t((session + 1) % kSessions)]);
                              --inside;
                              ++done;
                              scheduler.release(sessions[std::size_t(session)], priority, milliseconds(0));
                              go(session, round + 1);
                            }));
  };
  for (int session = 0; session < kSessions; ++session) asio::post(io, [&go, session] { go(session, 0); });
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&io] { io.run(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, kSessions * kRounds);
  EXPECT_LE(most, 2);
}

}  // namespace
}  // namespace intervale
