#include "server/serve/turnstile.h"

#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/bind_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace intervale {
namespace {

namespace asio = boost::asio;
using std::chrono::milliseconds;
using Turn = Turnstile::Turn;

class TurnstileLaws : public ::testing::Test {
 protected:
  void enter(Turnstile::Id session, Turn turn) {
    turnstile_.enter(session, turn, asio::bind_executor(io_, [this, session] { inside_ += char('a' + session); }));
  }
  // Lets everybody in who may, and tells who is new.
  std::string inside() {
    io_.restart();
    io_.poll();
    return std::exchange(inside_, "");
  }

  asio::io_context io_;
  Turnstile turnstile_{2};
  std::string inside_;
};

TEST_F(TurnstileLaws, AsManyAsThereAreSeats) {
  for (const Turnstile::Id session : {0, 1}) enter(session, Turn::more);
  EXPECT_FALSE(turnstile_.crowded());
  for (const Turnstile::Id session : {2, 3}) enter(session, Turn::more);
  EXPECT_TRUE(turnstile_.crowded());
  EXPECT_EQ(inside(), "ab");
  EXPECT_EQ(inside(), "");
  turnstile_.leave(Turn::more, milliseconds(1));
  EXPECT_EQ(inside(), "c");
  turnstile_.leave(Turn::more, milliseconds(1));
  EXPECT_EQ(inside(), "d");
  EXPECT_FALSE(turnstile_.crowded());
  for (int i = 0; i < 2; ++i) turnstile_.leave(Turn::more, milliseconds(1));
  enter(4, Turn::more);
  EXPECT_EQ(inside(), "e") << "a seat was left free";
}

TEST_F(TurnstileLaws, NobodyIsLetInBeforeEnterReturns) {
  bool entered = false;
  turnstile_.enter(0, Turn::answer, asio::bind_executor(io_, [&] { entered = true; }));
  EXPECT_FALSE(entered);
  io_.poll();
  EXPECT_TRUE(entered);
}

TEST_F(TurnstileLaws, AnswersGoFirst) {
  for (const Turnstile::Id session : {0, 1, 2, 3}) enter(session, Turn::more);
  for (const Turnstile::Id session : {4, 5}) enter(session, Turn::answer);
  EXPECT_EQ(inside(), "ab");
  std::string order;
  for (int i = 0; i < 4; ++i) {
    turnstile_.leave(Turn::more, milliseconds(0));
    order += inside();
  }
  EXPECT_EQ(order, "efcd");
}

TEST_F(TurnstileLaws, WhoHurriesGoesBehindTheLastAnswer) {
  for (const Turnstile::Id session : {0, 1, 2, 3}) enter(session, Turn::more);
  enter(4, Turn::answer);
  turnstile_.hurry(3);
  turnstile_.hurry(3);
  turnstile_.hurry(0);  // inside
  turnstile_.hurry(9);  // nowhere
  EXPECT_EQ(inside(), "ab");
  std::string order;
  for (int i = 0; i < 3; ++i) {
    turnstile_.leave(Turn::more, milliseconds(0));
    order += inside();
  }
  EXPECT_EQ(order, "edc");
}

// However many answers there are, an eighth of the time is for the others; and the other way round answers have what they want.
TEST_F(TurnstileLaws, NobodyWaitsForEver) {
  for (const double wanted : {0.5, 3.0}) {  // milliseconds that one of the others takes, answers take 1
    Turnstile turnstile(1);
    std::string order;
    const auto enter = [&](Turn turn) {
      turnstile.enter(turn == Turn::answer ? 0 : 1, turn, asio::bind_executor(io_, [&order, turn] { order += turn == Turn::answer ? 'a' : 'm'; }));
    };
    for (int i = 0; i < 2; ++i) {
      enter(Turn::more);
      enter(Turn::answer);
    }
    double answers = 0, others = 0;
    for (int i = 0; i < 20000; ++i) {
      io_.restart();
      io_.poll();
      ASSERT_EQ(order.size(), 1u);
      const Turn turn = order[0] == 'a' ? Turn::answer : Turn::more;
      order.clear();
      const double time = turn == Turn::answer ? 1 : wanted;
      (turn == Turn::answer ? answers : others) += time;
      enter(turn);  // and again, at once
      turnstile.leave(turn, std::chrono::duration_cast<Turnstile::Time>(std::chrono::duration<double, std::milli>(time)));
    }
    io_.restart();
    io_.poll();  // the last one
    EXPECT_NEAR(others / (answers + others), 0.125, 0.02) << wanted;
  }
}

TEST_F(TurnstileLaws, ClearForgetsAllWhoWait) {
  const auto token = std::make_shared<int>(1);
  for (const Turnstile::Id session : {0, 1}) enter(session, Turn::more);
  for (const Turn turn : {Turn::more, Turn::answer}) turnstile_.enter(7, turn, asio::bind_executor(io_, [token] {}));
  EXPECT_EQ(token.use_count(), 3);
  turnstile_.clear();
  EXPECT_EQ(token.use_count(), 1);
  EXPECT_FALSE(turnstile_.crowded());
  turnstile_.hurry(7);
}

TEST(Turnstile, NeverMoreInsideThanSeatsWhateverTheThreads) {
  asio::io_context io;
  Turnstile turnstile(2);
  std::atomic<int> inside{0}, most{0}, done{0};
  constexpr int kSessions = 50, kTurns = 100;
  std::function<void(Turnstile::Id, int)> go = [&](Turnstile::Id session, int turns) {
    if (turns == kTurns) return;
    const Turn turn = (session + unsigned(turns)) % 3 == 0 ? Turn::answer : Turn::more;
    turnstile.enter(session, turn, asio::bind_executor(io, [&, session, turns, turn] {
                      const int now = ++inside;
                      for (int seen = most; seen < now && !most.compare_exchange_weak(seen, now);) {
                      }
                      turnstile.hurry((session + 1) % kSessions);
                      --inside;
                      ++done;
                      turnstile.leave(turn, milliseconds(0));
                      go(session, turns + 1);
                    }));
  };
  for (Turnstile::Id session = 0; session < kSessions; ++session) asio::post(io, [&go, session] { go(session, 0); });
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i) threads.emplace_back([&io] { io.run(); });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, kSessions * kTurns);
  EXPECT_LE(most, 2);
}

}  // namespace
}  // namespace intervale
