#include "client/core/grants.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <queue>
#include <string>
#include <vector>

namespace intervale {
namespace {

TEST(Grants, AWindowIsOpenedAgainInQuarters) {
  Grants grants(UINT64_MAX, 8000);
  EXPECT_EQ(grants.take_all(), 8000u);
  EXPECT_EQ(grants.take(), 0u);
  EXPECT_TRUE(grants.spend(1999));
  EXPECT_EQ(grants.take(), 0u);
  EXPECT_TRUE(grants.spend(1));
  EXPECT_EQ(grants.take(), 2000u);
  EXPECT_TRUE(grants.spend(5000));
  EXPECT_EQ(grants.take(), 2000u);
  EXPECT_EQ(grants.take(), 2000u);
  EXPECT_EQ(grants.take(), 0u);
  EXPECT_FALSE(grants.exhausted());
}

TEST(Grants, MoreThanWasGrantedIsNotToBeSpent) {
  Grants grants(UINT64_MAX, 8000);
  EXPECT_FALSE(grants.spend(1));
  EXPECT_EQ(grants.take_all(), 8000u);
  EXPECT_FALSE(grants.spend(8001));
  EXPECT_TRUE(grants.spend(8000));
}

TEST(Grants, ABudgetIsGrantedToItsEnd) {
  Grants grants(9000, 8000);
  EXPECT_EQ(grants.take_all(), 8000u);
  EXPECT_TRUE(grants.spend(7000));
  EXPECT_EQ(grants.take(), 1000u);  // less than a quarter, but all there is
  EXPECT_FALSE(grants.exhausted());
  EXPECT_TRUE(grants.spend(1000));
  EXPECT_TRUE(grants.exhausted());
}

TEST(Grants, ANewSessionIsGrantedWhatTheOldOneDidNotSpend) {
  Grants grants(9000, 8000);
  EXPECT_EQ(grants.take_all(), 8000u);
  EXPECT_TRUE(grants.spend(3000));
  grants.forget_outstanding();
  EXPECT_EQ(grants.take_all(), 6000u);
}

// A line with a rate and a round trip, and a server that always has something to send: what it carries, and what is outstanding.
struct Carried {
  double share = 0;  // of what the line could carry, once the window had time to settle
  std::uint64_t window = 0;
};
Carried carry(double bytes_per_second, double round_trip) {
  constexpr double kSettle = 20, kEnd = 40;
  Grants grants(UINT64_MAX);
  const Grants::Clock::time_point start{};
  const auto at = [&](double t) { return start + std::chrono::duration_cast<Grants::Clock::duration>(std::chrono::duration<double>(t)); };
  struct Event {
    double time = 0;
    std::uint64_t bytes = 0;
    bool is_grant = false;
  };
  const auto later = [](const Event& a, const Event& b) { return a.time > b.time; };
  std::priority_queue<Event, std::vector<Event>, decltype(later)> events(later);
  grants.round_trip(at(round_trip) - start);
  events.push({round_trip / 2, grants.take_all(), true});
  std::uint64_t credit = 0;
  double free = 0, carried = 0;
  while (!events.empty() && events.top().time < kEnd) {
    const Event e = events.top();
    events.pop();
    if (e.is_grant) {
      credit += e.bytes;
      while (credit >= protocol::kMinCredit) {  // in batches as large as the last grant, 60 kB at most
        const std::uint64_t bytes = std::min({credit, std::max(e.bytes, protocol::kMinCredit), std::uint64_t(60000)});
        credit -= bytes;
        free = std::max(free, e.time) + double(bytes) / bytes_per_second;
        events.push({free + round_trip / 2, bytes, false});
      }
    } else {
      EXPECT_TRUE(grants.spend(e.bytes));
      if (e.time > kSettle) carried += double(e.bytes);
      grants.applied(e.bytes, at(e.time));
      while (const std::uint64_t more = grants.take()) events.push({e.time + round_trip / 2, more, true});
    }
  }
  return {carried / (bytes_per_second * (kEnd - kSettle)), grants.window()};
}

TEST(Grants, TheWindowGoesByTheLine) {
  for (const double rate : {20e3, 100e3, 1e6, 10e6, 40e6}) {
    for (const double round_trip : {0.001, 0.02, 0.05, 0.2}) {
      const Carried c = carry(rate, round_trip);
      const double fits = rate * (round_trip + 0.06);
      SCOPED_TRACE(std::to_string(rate) + " bytes/s, " + std::to_string(round_trip) + " s: window " + std::to_string(c.window));
      if (2 * fits < double(Grants::kMostWindow)) {
        EXPECT_GT(c.share, 0.8);
      }
      EXPECT_LE(double(c.window), std::max(double(Grants::kLeastWindow), 2.4 * fits + 1));
    }
  }
}

TEST(Grants, AFixedWindowStays) {
  Grants grants(UINT64_MAX, 8000);
  EXPECT_EQ(grants.take_all(), 8000u);
  grants.round_trip(std::chrono::milliseconds(1));
  for (int i = 0; i < 100; ++i) grants.applied(4000, Grants::Clock::time_point() + std::chrono::milliseconds(100 * i));
  EXPECT_EQ(grants.window(), 8000u);
}

TEST(Grants, NothingIsGrantedWhileAWindowThatShrankIsOutstanding) {
  Grants grants(UINT64_MAX);
  EXPECT_EQ(grants.take_all(), protocol::kDefaultWindow);
  grants.round_trip(std::chrono::milliseconds(1));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(grants.spend(1000));
    grants.applied(1000, Grants::Clock::time_point() + std::chrono::seconds(i));
    EXPECT_EQ(grants.take(), 0u);
  }
  EXPECT_EQ(grants.window(), Grants::kLeastWindow);
}

}  // namespace
}  // namespace intervale
