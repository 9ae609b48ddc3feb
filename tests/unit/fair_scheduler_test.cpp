#include "server/serve/fair_scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace intervale {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;
using Account = FairScheduler::Account;
using Lane = FairScheduler::Lane;
using Priority = FairScheduler::Priority;

// Sessions of one account.
std::deque<FairScheduler::Flow> flows(std::size_t count, const std::shared_ptr<Account>& account) {
  std::deque<FairScheduler::Flow> flows;
  for (std::size_t i = 0; i < count; ++i) flows.emplace_back(account);
  return flows;
}

class FairSchedulerTest : public ::testing::Test {
 protected:
  void acquire(int session, Priority priority) {
    scheduler_.async_acquire(sessions_[std::size_t(session)], priority,
                             asio::bind_executor(io_, [this, session](Lane) { running_ += char('a' + session); }));
  }
  void release(int session, Priority priority, int ms) {
    scheduler_.release(sessions_[std::size_t(session)], Lane::usual, priority, milliseconds(ms));
  }
  // Runs the handlers; returns the sessions that were assigned a worker since the last call.
  std::string started() {
    io_.restart();
    io_.poll();
    return std::exchange(running_, "");
  }

  std::shared_ptr<Account> account_ = std::make_shared<Account>();
  std::deque<FairScheduler::Flow> sessions_ = flows(10, account_);
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
  scheduler_.async_acquire(sessions_[0], Priority::interactive, asio::bind_executor(io_, [&](Lane) { entered = true; }));
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
  std::size_t account = 0;
};
std::vector<double> shares(const std::vector<Load>& loads) {
  constexpr int kRounds = 20000;
  asio::io_context io;
  std::array<std::shared_ptr<Account>, 2> accounts{std::make_shared<Account>(), std::make_shared<Account>()};
  std::deque<FairScheduler::Flow> sessions;
  for (const Load& load : loads) sessions.emplace_back(accounts[load.account]);
  FairScheduler scheduler(1);
  std::vector<std::size_t> inside;
  const auto acquire = [&](std::size_t session) {
    scheduler.async_acquire(sessions[session], loads[session].priority,
                            asio::bind_executor(io, [&inside, session](Lane) { inside.push_back(session); }));
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
    const auto& [priority, ms, account] = loads[session];
    times[session] += ms;
    all += ms;
    acquire(session);
    const auto time = std::chrono::duration_cast<FairScheduler::Time>(std::chrono::duration<double, std::milli>(ms));
    scheduler.charge(*accounts[account], time);
    scheduler.release(sessions[session], Lane::usual, priority, time);
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

TEST(FairScheduler, AnAccountGetsNoMoreTimeForHavingManySessions) {
  for (const Priority priority : {Priority::interactive, Priority::bulk}) {
    std::vector<Load> loads(20, Load{priority, 1, 0});
    loads.push_back({priority, 1, 1});
    EXPECT_NEAR(shares(loads).back(), 0.5, 0.02);
  }
}

TEST_F(FairSchedulerTest, WhoeverSpentLessGoesFirst) {
  const auto spender = std::make_shared<Account>();
  std::deque<FairScheduler::Flow> old = flows(2, spender);
  const auto acquire_old = [&](std::size_t i, Priority priority) {
    scheduler_.async_acquire(old[i], priority, asio::bind_executor(io_, [this, i](Lane) { running_ += char('x' + i); }));
  };
  for (const int session : {0, 1}) acquire(session, Priority::bulk);
  scheduler_.charge(*spender, milliseconds(5000));
  acquire_old(0, Priority::interactive);
  acquire_old(1, Priority::bulk);
  acquire(2, Priority::bulk);
  acquire(3, Priority::interactive);
  EXPECT_EQ(started(), "ab");
  std::string order;
  for (const int session : {0, 1}) {
    release(session, Priority::bulk, 1);
    order += started();
  }
  release(2, Priority::bulk, 1);
  release(3, Priority::interactive, 1);
  EXPECT_EQ(order, "dc");
  EXPECT_EQ(started(), "xy") << "nobody starves while there is time";
}

// If its account spent somewhat more than that of the bulk work.
TEST(FairScheduler, InteractiveWorkOfWhoSpentMoreGetsHalf) {
  const auto spent = [](int ms) {
    const auto account = std::make_shared<Account>();
    return std::pair(account, milliseconds(ms));
  };
  FairScheduler scheduler(1);
  asio::io_context io;
  const auto more = spent(1200), less = spent(500);
  for (const auto& [account, time] : {more, less}) scheduler.charge(*account, time);
  FairScheduler::Flow turns(more.first), streams(less.first);
  std::string order;
  const auto acquire = [&](FairScheduler::Flow& flow, Priority priority, char name) {
    scheduler.async_acquire(flow, priority, asio::bind_executor(io, [&order, name](Lane) { order += name; }));
  };
  acquire(turns, Priority::interactive, 't');
  for (int i = 0; i < 20; ++i) {
    io.restart();
    io.poll();
    const bool turned = order.back() == 't';
    acquire(turned ? turns : streams, turned ? Priority::interactive : Priority::bulk, order.back());
    if (i == 0) acquire(streams, Priority::bulk, 's');
    scheduler.release(turned ? turns : streams, Lane::usual, turned ? Priority::interactive : Priority::bulk, milliseconds(1));
  }
  EXPECT_NEAR(double(std::count(order.begin(), order.end(), 't')), 10, 1) << order;
}

TEST(FairScheduler, AnAccountIsHeavyBesideOneThatSpentMuchLess) {
  using std::chrono::seconds;
  FairScheduler scheduler(1);
  Account heavy, light;
  auto now = FairScheduler::Clock::now();
  scheduler.charge(heavy, seconds(10), now);
  EXPECT_FALSE(FairScheduler::is_heavy(heavy)) << "nobody else is there";
  scheduler.charge(light, milliseconds(1), now);
  scheduler.charge(heavy, milliseconds(1), now);
  EXPECT_TRUE(FairScheduler::is_heavy(heavy));
  EXPECT_FALSE(FairScheduler::is_heavy(light));
  scheduler.charge(heavy, milliseconds(1), now + milliseconds(600));
  EXPECT_TRUE(FairScheduler::is_heavy(heavy)) << "the other one was there lately";
  scheduler.charge(heavy, milliseconds(1), now + milliseconds(1300));
  EXPECT_FALSE(FairScheduler::is_heavy(heavy)) << "it is gone";
  now += seconds(2);
  scheduler.charge(light, seconds(3), now);
  scheduler.charge(heavy, milliseconds(1), now);
  EXPECT_FALSE(FairScheduler::is_heavy(heavy)) << "the other one spent as much";
}

TEST_F(FairSchedulerTest, WhatHeavyAccountsWaitForIsToldApart) {
  Account light;
  const auto now = FairScheduler::Clock::now();
  scheduler_.charge(light, milliseconds(1), now);
  scheduler_.charge(*account_, milliseconds(10'000), now);
  ASSERT_TRUE(FairScheduler::is_heavy(*account_));
  for (const int session : {0, 1}) acquire(session, Priority::bulk);
  EXPECT_FALSE(scheduler_.has_waiters());
  acquire(2, Priority::bulk);
  EXPECT_TRUE(scheduler_.has_waiters());
  EXPECT_TRUE(scheduler_.has_waiters(Lane::heavy));
  EXPECT_FALSE(scheduler_.has_waiters(Lane::usual));
  scheduler_.clear();
}

TEST_F(FairSchedulerTest, WhatWasSpentCountsHalfAfterAHalfLife) {
  const auto now = FairScheduler::Clock::now();
  const auto seconds = [&](FairScheduler::Clock::time_point when) {
    return std::chrono::duration<double>(scheduler_.spent(*account_, when)).count();
  };
  EXPECT_EQ(seconds(now), 0);
  scheduler_.charge(*account_, milliseconds(3000), now);
  EXPECT_NEAR(seconds(now), 3, 1e-6);
  EXPECT_NEAR(seconds(now + FairScheduler::kHalfLife), 1.5, 1e-6);
  scheduler_.charge(*account_, milliseconds(1000), now + FairScheduler::kHalfLife);
  EXPECT_NEAR(seconds(now + 2 * FairScheduler::kHalfLife), 1.25, 1e-6);
  EXPECT_LT(seconds(now + 20 * FairScheduler::kHalfLife), 1e-5);
}

TEST_F(FairSchedulerTest, ClearDestroysAllWaitingHandlers) {
  const auto token = std::make_shared<int>(1);
  for (const int session : {0, 1}) acquire(session, Priority::bulk);
  for (const Priority priority : {Priority::bulk, Priority::interactive})
    scheduler_.async_acquire(sessions_[7], priority, asio::bind_executor(io_, [token](Lane) {}));
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
  const std::array accounts{std::make_shared<Account>(), std::make_shared<Account>(), std::make_shared<Account>()};
  std::deque<FairScheduler::Flow> sessions;
  for (int session = 0; session < kSessions; ++session) sessions.emplace_back(accounts[std::size_t(session % 3)]);
  std::function<void(int, int)> go = [&](int session, int round) {
    if (round == kRounds) return;
    const Priority priority = (session + round) % 3 == 0 ? Priority::interactive : Priority::bulk;
    scheduler.async_acquire(sessions[std::size_t(session)], priority, asio::bind_executor(io, [&, session, round, priority](Lane) {
                              const int now = ++inside;
                              for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
                              }
                              scheduler.promote(sessions[std::size_t((session + 1) % kSessions)]);
                              --inside;
                              ++done;
                              scheduler.release(sessions[std::size_t(session)], Lane::usual, priority, milliseconds(0));
                              go(session, round + 1);
                            }));
  };
  for (int session = 0; session < kSessions; ++session) asio::post(io, [&go, session] { go(session, 0); });
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int i = 0; i < 4; ++i) threads.emplace_back([&io] { io.run(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, kSessions * kRounds);
  EXPECT_LE(most, 2);
}

}  // namespace
}  // namespace intervale
