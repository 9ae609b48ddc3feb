#include "server/serve/scale_demand.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>

#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

using std::chrono::seconds;
using Clock = ScaleDemand::Clock;

struct ScaleDemandTest : ::testing::Test {
  using Shared = std::shared_ptr<const IntervalVolume>;
  static Shared make(double low) {
    Volume volume = testing::gyroid({9, 9, 9});
    volume.name = "scan";
    return testing::build_shared(volume, {{low, 0.5}});
  }
  const Shared some = make(0), more = make(-0.2), other = make(0.1);
  const Clock::time_point now = Clock::now();
  ScaleDemand demand;
};

TEST_F(ScaleDemandTest, OneWantsMoreThanItHasAsLongAsItIsThere) {
  int woken = 0;
  demand.set_wake([&woken] { ++woken; });
  std::optional<ScaleDemand::Use> use(std::in_place, demand, "scan"), second(std::in_place, demand, "scan");
  EXPECT_TRUE(use->want(nullptr));
  EXPECT_FALSE(demand.is_wanted(*some)) << "it is open, and no more is wanted";
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(use->want(some.get()));
  EXPECT_EQ(woken, 1);
  EXPECT_TRUE(demand.is_wanted(*some));
  EXPECT_FALSE(demand.is_wanted(*other)) << "other contents of that name";
  EXPECT_TRUE(second->want(some.get()));
  EXPECT_TRUE(use->want(more.get())) << "it has grown";
  EXPECT_TRUE(demand.is_wanted(*some));
  EXPECT_TRUE(demand.is_wanted(*more));
  EXPECT_TRUE(second->want(nullptr));
  EXPECT_FALSE(demand.is_wanted(*some));
  use.reset();
  EXPECT_FALSE(demand.is_wanted(*more));
}

TEST_F(ScaleDemandTest, WhatNoSessionUsesIsIdle) {
  std::optional<ScaleDemand::Use> one(std::in_place, demand, "scan"), second(std::in_place, demand, "scan");
  one.reset();
  EXPECT_FALSE(demand.is_idle("scan", seconds(0), now + seconds(1000)));
  second.reset();
  const auto end = Clock::now();
  EXPECT_FALSE(demand.is_idle("scan", seconds(60), now + seconds(59)));
  EXPECT_TRUE(demand.is_idle("scan", seconds(60), end + seconds(60)));
  EXPECT_TRUE(demand.is_idle("none", seconds(60))) << "nobody has used it";
}

TEST_F(ScaleDemandTest, WhatCannotBeHadIsRefusedForAWhileLongerWithEachTime) {
  ScaleDemand::Use use(demand, "scan");
  auto at = now;
  for (const seconds time : {ScaleDemand::kRetry, 2 * ScaleDemand::kRetry, 4 * ScaleDemand::kRetry, 8 * ScaleDemand::kRetry,
                             ScaleDemand::kLongestRetry, ScaleDemand::kLongestRetry}) {
    EXPECT_TRUE(use.want(some.get(), at));
    EXPECT_TRUE(demand.is_wanted(*some, at));
    demand.refuse(*some, at);
    EXPECT_FALSE(demand.is_wanted(*some, at));
    at += time;
    EXPECT_FALSE(use.want(some.get(), at - seconds(1)));
    EXPECT_TRUE(use.want(more.get(), at - seconds(1))) << "of other contents nothing is known";
    EXPECT_TRUE(demand.is_wanted(*more, at - seconds(1)));
  }
  demand.refuse(*more, at);
  EXPECT_FALSE(use.want(more.get(), at + ScaleDemand::kRetry - seconds(1)));
  EXPECT_TRUE(use.want(more.get(), at + ScaleDemand::kRetry));
}

}  // namespace
}  // namespace intervale
