#include "server/serve/scale_demand.h"

#include <gtest/gtest.h>

#include <chrono>

namespace intervale {
namespace {

using std::chrono::seconds;
using Clock = ScaleDemand::Clock;

TEST(ScaleDemand, WhatIsAskedForIsWantedUntilItIsThere) {
  ScaleDemand demand;
  int woken = 0;
  demand.set_wake([&woken] { ++woken; });
  EXPECT_FALSE(demand.is_asked("scan", 0));
  const auto use = demand.use("scan");
  EXPECT_FALSE(demand.is_asked("scan", 0)) << "it is open, and no more is wanted";
  EXPECT_TRUE(demand.ask("scan", 100));
  EXPECT_TRUE(demand.ask("scan", 100));
  EXPECT_TRUE(demand.ask("scan", 50)) << "of who does not know yet that there is more";
  EXPECT_EQ(woken, 3);
  EXPECT_TRUE(demand.is_asked("scan", 50));
  EXPECT_TRUE(demand.is_asked("scan", 100));
  EXPECT_FALSE(demand.is_asked("scan", 101));
  EXPECT_FALSE(demand.is_asked("other", 0));
  EXPECT_TRUE(demand.ask("scan", 800));
  EXPECT_TRUE(demand.is_asked("scan", 101));
  EXPECT_EQ(woken, 4);
}

TEST(ScaleDemand, IsForgottenSomeTimeAfterTheLastSession) {
  ScaleDemand demand;
  auto one = demand.use("scan"), other = demand.use("scan");
  const auto now = Clock::now();
  EXPECT_TRUE(demand.ask("scan", 100, now));
  one.reset();
  EXPECT_TRUE(demand.is_asked("scan", 100, now + seconds(1000)));
  EXPECT_FALSE(demand.is_idle("scan", seconds(0), now + seconds(1000)));
  other.reset();
  const auto end = Clock::now();
  EXPECT_TRUE(demand.is_asked("scan", 100, now + ScaleDemand::kLinger - seconds(1))) << "a client that resumes comes again";
  EXPECT_FALSE(demand.is_asked("scan", 100, end + ScaleDemand::kLinger));
  EXPECT_FALSE(demand.is_idle("scan", seconds(60), now + seconds(59)));
  EXPECT_TRUE(demand.is_idle("scan", seconds(60), end + seconds(60)));
  EXPECT_TRUE(demand.is_idle("other", seconds(60))) << "nobody has used it";
  const auto again = demand.use("scan");
  EXPECT_FALSE(demand.is_asked("scan", 100)) << "it was idle";
}

TEST(ScaleDemand, WhatCannotBeHadIsRefusedForAWhile) {
  ScaleDemand demand;
  const auto use = demand.use("scan");
  const auto now = Clock::now();
  EXPECT_TRUE(demand.ask("scan", 100, now));
  demand.refuse("scan", now);
  EXPECT_FALSE(demand.is_asked("scan", 100, now));
  EXPECT_FALSE(demand.ask("scan", 100, now + seconds(1)));
  EXPECT_FALSE(demand.is_asked("scan", 100, now + seconds(1)));
  EXPECT_TRUE(demand.ask("scan", 100, now + ScaleDemand::kRetry));
  EXPECT_TRUE(demand.is_asked("scan", 100, now + ScaleDemand::kRetry));
}

}  // namespace
}  // namespace intervale
