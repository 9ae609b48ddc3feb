#include "client/core/credit_window.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <queue>
#include <string>
#include <vector>

namespace intervale {
namespace {

TEST(CreditWindow, GrantsSpentCreditAgainInQuarters) {
  CreditWindow window(UINT64_MAX, 8000);
  EXPECT_EQ(window.grant_window(), 8000u);
  EXPECT_EQ(window.grant_more(), 0u);
  EXPECT_TRUE(window.spend(1999));
  EXPECT_EQ(window.grant_more(), 0u);
  EXPECT_TRUE(window.spend(1));
  EXPECT_EQ(window.grant_more(), 2000u);
  EXPECT_TRUE(window.spend(5000));
  EXPECT_EQ(window.grant_more(), 2000u);
  EXPECT_EQ(window.grant_more(), 2000u);
  EXPECT_EQ(window.grant_more(), 0u);
  EXPECT_FALSE(window.is_exhausted());
}

TEST(CreditWindow, RefusesToSpendMoreThanWasGranted) {
  CreditWindow window(UINT64_MAX, 8000);
  EXPECT_FALSE(window.spend(1));
  EXPECT_EQ(window.grant_window(), 8000u);
  EXPECT_FALSE(window.spend(8001));
  EXPECT_TRUE(window.spend(8000));
}

TEST(CreditWindow, GrantsTheBudgetToItsEnd) {
  CreditWindow window(9000, 8000);
  EXPECT_EQ(window.grant_window(), 8000u);
  EXPECT_TRUE(window.spend(7000));
  EXPECT_EQ(window.grant_more(), 1000u);  // less than a quarter, but all there is
  EXPECT_FALSE(window.is_exhausted());
  EXPECT_TRUE(window.spend(1000));
  EXPECT_TRUE(window.is_exhausted());
}

TEST(CreditWindow, ReturnsUnspentCreditToTheBudgetWhenASessionEnds) {
  CreditWindow window(9000, 8000);
  EXPECT_EQ(window.grant_window(), 8000u);
  EXPECT_TRUE(window.spend(3000));
  window.end_session();
  EXPECT_EQ(window.grant_window(), 6000u);
}

// A simulated connection with a rate and a round trip, and a server that always has something to send.
struct Carried {
  double share = 0;  // of what the connection could carry, once the window had time to settle
  std::uint64_t window = 0;
};
Carried carry(double bytes_per_second, double round_trip) {
  constexpr double kSettle = 20, kEnd = 40;
  CreditWindow window(UINT64_MAX);
  const CreditWindow::Clock::time_point start{};
  const auto at = [&](double t) { return start + std::chrono::duration_cast<CreditWindow::Clock::duration>(std::chrono::duration<double>(t)); };
  struct Event {
    double time = 0;
    std::uint64_t bytes = 0;
    bool is_grant = false;
  };
  const auto later = [](const Event& a, const Event& b) { return a.time > b.time; };
  std::priority_queue<Event, std::vector<Event>, decltype(later)> events(later);
  window.note_round_trip(at(round_trip) - start);
  events.push({round_trip / 2, window.grant_window(), true});
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
      EXPECT_TRUE(window.spend(e.bytes));
      if (e.time > kSettle) carried += double(e.bytes);
      window.note_batch(e.bytes, at(e.time));
      while (const std::uint64_t more = window.grant_more()) events.push({e.time + round_trip / 2, more, true});
    }
  }
  return {carried / (bytes_per_second * (kEnd - kSettle)), window.window()};
}

TEST(CreditWindow, AdaptsToRateAndRoundTrip) {
  for (const double rate : {20e3, 100e3, 1e6, 10e6, 40e6}) {
    for (const double round_trip : {0.001, 0.02, 0.05, 0.2}) {
      const Carried c = carry(rate, round_trip);
      const double fits = rate * (round_trip + 0.06);
      SCOPED_TRACE(std::to_string(rate) + " bytes/s, " + std::to_string(round_trip) + " s: window " + std::to_string(c.window));
      if (2 * fits < double(CreditWindow::kMaxWindow)) {
        EXPECT_GT(c.share, 0.8);
      }
      EXPECT_LE(double(c.window), std::max(double(CreditWindow::kMinWindow), 2.4 * fits + 1));
    }
  }
}

TEST(CreditWindow, KeepsAFixedWindow) {
  CreditWindow window(UINT64_MAX, 8000);
  EXPECT_EQ(window.grant_window(), 8000u);
  window.note_round_trip(std::chrono::milliseconds(1));
  for (int i = 0; i < 100; ++i) window.note_batch(4000, CreditWindow::Clock::time_point() + std::chrono::milliseconds(100 * i));
  EXPECT_EQ(window.window(), 8000u);
}

TEST(CreditWindow, GrantsNothingWhileMoreThanAShrunkWindowIsOutstanding) {
  CreditWindow window(UINT64_MAX);
  EXPECT_EQ(window.grant_window(), protocol::kDefaultWindow);
  window.note_round_trip(std::chrono::milliseconds(1));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(window.spend(1000));
    window.note_batch(1000, CreditWindow::Clock::time_point() + std::chrono::seconds(i));
    EXPECT_EQ(window.grant_more(), 0u);
  }
  EXPECT_EQ(window.window(), CreditWindow::kMinWindow);
}

}  // namespace
}  // namespace intervale
