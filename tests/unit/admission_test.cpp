#include "server/serve/admission.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

namespace intervale {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

TEST(RateLimit, AdmitsItsRateAndABurstOfOneSecond) {
  RateLimit limit(10);
  auto now = Clock::now();
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit.take(now), 0ns) << "a burst after silence";
  EXPECT_EQ(limit.take(now), 100ms);
  EXPECT_EQ(limit.take(now), 200ms);
  now += 200ms;
  EXPECT_EQ(limit.take(now), 100ms);
  // Whoever waits as aborted has so many, whatever else happens.
  int taken = 0;
  const auto end = now + 10s;
  while (now < end) {
    now += limit.take(now);
    ++taken;
  }
  EXPECT_NEAR(taken, 100, 2);
  now += 1h;
  for (int i = 0; i < 10; ++i) EXPECT_EQ(limit.take(now), 0ns);
  EXPECT_GT(limit.take(now), 0ns) << "the burst is limited to one second";
}

boost::asio::ip::address address(const char* text) { return boost::asio::ip::make_address(text); }

TEST(AddressCounts, CountsAnIpv6AddressWithItsNetwork) {
  AddressCounts counts;
  auto first = counts.try_acquire(address("192.0.2.1"), 2);
  auto second = counts.try_acquire(address("192.0.2.1"), 2);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(counts.try_acquire(address("192.0.2.1"), 2));
  EXPECT_FALSE(counts.try_acquire(address("::ffff:192.0.2.1"), 2)) << "the same address, mapped to IPv6";
  EXPECT_TRUE(counts.try_acquire(address("192.0.2.2"), 2));
  first.reset();
  AddressCounts::Lease moved = *counts.try_acquire(address("192.0.2.1"), 2);
  second = std::move(moved);
  EXPECT_TRUE(counts.try_acquire(address("192.0.2.1"), 2).has_value());

  const auto six = counts.try_acquire(address("2001:db8::1"), 1);
  EXPECT_FALSE(counts.try_acquire(address("2001:db8::ffff:2"), 1));
  EXPECT_TRUE(counts.try_acquire(address("2001:db8:0:1::1"), 1));
}

struct FakeConnection : Connection {
  bool aborted = false;
  void begin_shutdown() override {}
  void abort(const char* /*why*/) override { aborted = true; }
};

TEST(WriteBudget, AbortsTheSlowestConnectionAboveItsLimit) {
  WriteBudget write_budget(100);
  const auto start = Clock::now();
  const auto slowest = std::make_shared<FakeConnection>(), slow = std::make_shared<FakeConnection>(), quick = std::make_shared<FakeConnection>();
  {
    const auto a = write_budget.reserve(slowest, 60, start);
    const auto b = write_budget.reserve(slow, 30, start + 500ms);
    EXPECT_EQ(write_budget.bytes(), 90u);
    {
      const auto c = write_budget.reserve(quick, 30, start + 900ms);
      EXPECT_FALSE(slowest->aborted) << "above the limit, but its write began less than 1 s ago";
    }
    const auto d = write_budget.reserve(quick, 10, start + 1100ms);
    EXPECT_FALSE(slowest->aborted) << "slow, but within the limit";
    const auto e = write_budget.reserve(quick, 10, start + 1200ms);
    EXPECT_TRUE(slowest->aborted);
    EXPECT_FALSE(slow->aborted) << "one was enough";
    EXPECT_FALSE(quick->aborted);
    EXPECT_EQ(write_budget.bytes(), 50u);
  }
  EXPECT_EQ(write_budget.bytes(), 0u);
}

}  // namespace
}  // namespace intervale
