#include "server/serve/guard.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

namespace intervale {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(RateLimit, LetsSoManyThroughASecond) {
  RateLimit limit(10);
  auto now = Clock::now();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit.take(now), 0ns) << "a burst, after silence";
  EXPECT_EQ(limit.take(now), 100ms);
  EXPECT_EQ(limit.take(now), 200ms);
  now += 200ms;
  EXPECT_EQ(limit.take(now), 100ms);
  // Whoever waits as told has so many, whatever else happens.
  int taken = 0;
  const auto end = now + 10s;
  while (now < end) {
    now += limit.take(now);
    ++taken;
  }
  EXPECT_NEAR(taken, 100, 2);
  now += 1h;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit.take(now), 0ns);
  EXPECT_GT(limit.take(now), 0ns) << "silence is not saved up";
}

boost::asio::ip::address address(const char* text) { return boost::asio::ip::make_address(text); }

TEST(AddressCounts, CountByHostAndByNetworkOfVersion6) {
  AddressCounts counts;
  auto first = counts.enter(address("192.0.2.1"), 2);
  auto second = counts.enter(address("192.0.2.1"), 2);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(counts.enter(address("192.0.2.1"), 2));
  EXPECT_FALSE(counts.enter(address("::ffff:192.0.2.1"), 2)) << "the same, by another name";
  EXPECT_TRUE(counts.enter(address("192.0.2.2"), 2));
  first.reset();
  AddressCounts::Seat moved = *counts.enter(address("192.0.2.1"), 2);
  second = std::move(moved);
  EXPECT_TRUE(counts.enter(address("192.0.2.1"), 2).has_value());

  const auto six = counts.enter(address("2001:db8::1"), 1);
  EXPECT_FALSE(counts.enter(address("2001:db8::ffff:2"), 1));
  EXPECT_TRUE(counts.enter(address("2001:db8:0:1::1"), 1));
}

struct Peer : Connection {
  bool dropped = false;
  void go_away() override {}
  void drop() override { dropped = true; }
};

TEST(Outbox, CutsOffWhoTakesTheLongestOncePastItsLimit) {
  Outbox outbox(100);
  const auto start = Clock::now();
  const auto slowest = std::make_shared<Peer>(), slow = std::make_shared<Peer>(), quick = std::make_shared<Peer>();
  {
    const auto a = outbox.add(slowest, 60, start);
    const auto b = outbox.add(slow, 30, start + 500ms);
    EXPECT_EQ(outbox.bytes(), 90u);
    {
      const auto c = outbox.add(quick, 30, start + 900ms);
      EXPECT_FALSE(slowest->dropped) << "past the limit, but not for long";
    }
    const auto d = outbox.add(quick, 10, start + 1100ms);
    EXPECT_FALSE(slowest->dropped) << "slow, but within the limit";
    const auto e = outbox.add(quick, 10, start + 1200ms);
    EXPECT_TRUE(slowest->dropped);
    EXPECT_FALSE(slow->dropped) << "it was enough";
    EXPECT_FALSE(quick->dropped);
    EXPECT_EQ(outbox.bytes(), 50u);
  }
  EXPECT_EQ(outbox.bytes(), 0u);
}

TEST(Memory, IsKnown) { EXPECT_GT(resident_bytes(), std::uint64_t(1) << 20); }

}  // namespace
}  // namespace intervale
