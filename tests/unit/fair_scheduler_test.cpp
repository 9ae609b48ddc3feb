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
  void enter(int session, Priority turn) {
    scheduler_.async_acquire(sessions_[session], turn, asio::bind_executor(io_, [this, session] { inside_ += char('a' + session); }));
  }
  void leave(int session, Priority turn, int ms) { scheduler_.release(sessions_[session], turn, milliseconds(ms)); }
  // Lets everybody in who may, and tells who is new.
  std::string inside() {
    io_.restart();
    io_.poll();
    return std::exchange(inside_, "");
  }

  std::array<FairScheduler::Flow, 10> sessions_;
  asio::io_context io_;
  FairScheduler scheduler_{2};
  std::string inside_;
};

TEST_F(FairSchedulerTest, AsManyAsThereAreSeats) {
  for (const int session : {0, 1}) enter(session, Priority::bulk);
  EXPECT_FALSE(scheduler_.has_waiters());
  for (const int session : {2, 3}) enter(session, Priority::bulk);
  EXPECT_TRUE(scheduler_.has_waiters());
  EXPECT_EQ(inside(), "ab");
  EXPECT_EQ(inside(), "");
  leave(0, Priority::bulk, 1);
  EXPECT_EQ(inside(), "c");
  leave(1, Priority::bulk, 1);
  EXPECT_EQ(inside(), "d");
  EXPECT_FALSE(scheduler_.has_waiters());
  for (const int session : {2, 3}) leave(session, Priority::bulk, 1);
  enter(4, Priority::bulk);
  EXPECT_EQ(inside(), "e") << "a seat was left free";
}

TEST_F(FairSchedulerTest, NobodyIsLetInBeforeEnterReturns) {
  bool entered = false;
  scheduler_.async_acquire(sessions_[0], Priority::interactive, asio::bind_executor(io_, [&] { entered = true; }));
  EXPECT_FALSE(entered);
  io_.poll();
  EXPECT_TRUE(entered);
}

TEST_F(FairSchedulerTest, AnswersGoFirst) {
  for (const int session : {0, 1, 2, 3}) enter(session, Priority::bulk);
  for (const int session : {4, 5}) enter(session, Priority::interactive);
  EXPECT_EQ(inside(), "ab");
  std::string order;
  for (int i = 0; i < 4; ++i) {
    leave(i, Priority::bulk, 0);
    order += inside();
  }
  EXPECT_EQ(order, "efcd");
}

TEST_F(FairSchedulerTest, WhoHurriesGoesBehindTheLastAnswer) {
  for (const int session : {0, 1, 2, 3}) enter(session, Priority::bulk);
  enter(4, Priority::interactive);
  scheduler_.promote(sessions_[3]);
  scheduler_.promote(sessions_[3]);
  scheduler_.promote(sessions_[0]);  // inside
  scheduler_.promote(sessions_[9]);  // nowhere
  EXPECT_EQ(inside(), "ab");
  std::string order;
  for (int i = 0; i < 3; ++i) {
    leave(i, Priority::bulk, 0);
    order += inside();
  }
  EXPECT_EQ(order, "edc");
}

// Sessions that want their next turn as soon as they have had one, at one seat. Turns and the milliseconds that each takes; the time that each
// session has had after many of them.
struct Wanting {
  Priority turn;
  double ms;
};
std::vector<double> shares(const std::vector<Wanting>& wanting) {
  constexpr int kTurns = 20000;
  asio::io_context io;
  std::vector<FairScheduler::Flow> sessions(wanting.size());
  FairScheduler scheduler(1);
  std::vector<std::size_t> inside;
  const auto enter = [&](std::size_t session) {
    scheduler.async_acquire(sessions[session], wanting[session].turn, asio::bind_executor(io, [&inside, session] { inside.push_back(session); }));
  };
  for (std::size_t session = 0; session < wanting.size(); ++session) enter(session);
  std::vector<double> times(wanting.size());
  double all = 0;
  for (int i = 0; i < kTurns; ++i) {
    io.restart();
    io.poll();
    EXPECT_EQ(inside.size(), 1u);
    const std::size_t session = inside.back();
    inside.clear();
    const auto& [turn, ms] = wanting[session];
    times[session] += ms;
    all += ms;
    enter(session);
    scheduler.release(sessions[session], turn, std::chrono::duration_cast<FairScheduler::Time>(std::chrono::duration<double, std::milli>(ms)));
  }
  io.restart();
  io.poll();  // the last one
  for (double& time : times) time /= all;
  return times;
}

// However many answers there are, an eighth of the time is for the others; and the other way round answers have what they want.
TEST(FairScheduler, NobodyWaitsForEver) {
  for (const double wanted : {0.5, 3.0}) {
    const auto times = shares({{Priority::bulk, wanted}, {Priority::bulk, wanted}, {Priority::interactive, 1}, {Priority::interactive, 1}});
    EXPECT_NEAR(times[0] + times[1], 0.125, 0.02) << wanted;
  }
}

TEST(FairScheduler, WhoAsksForWhatTakesLongHasNoMoreTimeThanOthers) {
  const auto times = shares({{Priority::interactive, 200}, {Priority::interactive, 1}, {Priority::interactive, 5}, {Priority::interactive, 50}});
  for (const double time : times) EXPECT_NEAR(time, 0.25, 0.02);
}

TEST_F(FairSchedulerTest, WhoComesNewGoesBeforeWhoHasHadMuch) {
  for (const int session : {0, 1}) enter(session, Priority::interactive);
  EXPECT_EQ(inside(), "ab");
  enter(0, Priority::interactive);  // with a view it wants while its last one is computed
  leave(0, Priority::interactive, 20);
  EXPECT_EQ(inside(), "a") << "nobody else wanted to";
  for (const int session : {0, 2, 3}) enter(session, Priority::interactive);
  std::string order;
  leave(1, Priority::interactive, 1);
  order += inside();
  leave(2, Priority::interactive, 1);
  order += inside();
  leave(3, Priority::interactive, 1);
  order += inside();
  EXPECT_EQ(order, "cda");
}

// Two seats: one is for those whose answers are short, as soon as it is known whose are not.
TEST_F(FairSchedulerTest, LongAnswersLeaveASeatToOthers) {
  for (const int session : {0, 1}) enter(session, Priority::interactive);
  for (const int session : {0, 1}) leave(session, Priority::interactive, 200);
  EXPECT_EQ(inside(), "ab");
  for (const int session : {0, 1}) enter(session, Priority::interactive);
  EXPECT_EQ(inside(), "a");
  EXPECT_TRUE(scheduler_.has_waiters());
  enter(2, Priority::interactive);
  EXPECT_EQ(inside(), "c") << "the seat was kept";
  leave(2, Priority::interactive, 1);
  EXPECT_EQ(inside(), "");
  enter(3, Priority::bulk);
  EXPECT_EQ(inside(), "d");
  leave(3, Priority::bulk, 1);
  EXPECT_EQ(inside(), "");
  leave(0, Priority::interactive, 200);
  EXPECT_EQ(inside(), "b") << "and nobody waits for ever";
  leave(1, Priority::interactive, 1);
  enter(1, Priority::interactive);
  enter(0, Priority::interactive);
  EXPECT_EQ(inside(), "ba") << "what is short now is not long any more";
}

TEST_F(FairSchedulerTest, ClearForgetsAllWhoWait) {
  const auto token = std::make_shared<int>(1);
  for (const int session : {0, 1}) enter(session, Priority::bulk);
  for (const Priority turn : {Priority::bulk, Priority::interactive})
    scheduler_.async_acquire(sessions_[7], turn, asio::bind_executor(io_, [token] {}));
  EXPECT_EQ(token.use_count(), 3);
  scheduler_.clear();
  EXPECT_EQ(token.use_count(), 1);
  EXPECT_FALSE(scheduler_.has_waiters());
  scheduler_.promote(sessions_[7]);
}

TEST(FairScheduler, NeverMoreInsideThanSeatsWhateverTheThreads) {
  asio::io_context io;
  FairScheduler scheduler(2);
  std::atomic<int> inside{0}, most{0}, done{0};
  constexpr int kSessions = 50, kTurns = 100;
  std::array<FairScheduler::Flow, kSessions> sessions;
  std::function<void(int, int)> go = [&](int session, int turns) {
    if (turns == kTurns) return;
    const Priority turn = (session + turns) % 3 == 0 ? Priority::interactive : Priority::bulk;
    scheduler.async_acquire(sessions[std::size_t(session)], turn, asio::bind_executor(io, [&, session, turns, turn] {
                              const int now = ++inside;
                              for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
                              }
                              scheduler.promote(sessions[std::size_t((session + 1) % kSessions)]);
                              --inside;
                              ++done;
                              scheduler.release(sessions[std::size_t(session)], turn, milliseconds(0));
                              go(session, turns + 1);
                            }));
  };
  for (int session = 0; session < kSessions; ++session) asio::post(io, [&go, session] { go(session, 0); });
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&io] { io.run(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, kSessions * kTurns);
  EXPECT_LE(most, 2);
}

}  // namespace
}  // namespace intervale
