#include "client/core/backoff.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "client/core/reconnecting.h"

namespace intervale {
namespace {

TEST(Backoff, DoublesToThreeSecondsCutByHalfAtMost) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Backoff backoff(seed);
    long whole = 100;
    for (int attempt = 0; attempt < 12; ++attempt, whole = std::min(2 * whole, 3000L)) {
      const long wait = backoff.next().count();
      EXPECT_LE(wait, whole);
      EXPECT_GE(wait, whole / 2);
    }
  }
}

TEST(Backoff, ClientsOfOneServerComeBackApart) {
  Backoff a(1), b(2);
  bool apart = false;
  for (int attempt = 0; attempt < 4; ++attempt) apart |= a.next() != b.next();
  EXPECT_TRUE(apart);
}

// The time begins anew with each loss, but not where a server opened the data set and sent nothing.
TEST(Reconnecting, EndsWhereNothingNewComes) {
  using Kind = ClientSession::Event::Kind;
  using std::chrono::seconds;
  const auto start = Reconnecting::Clock::now();
  Reconnecting reconnecting(seconds(30));
  reconnecting.connected();
  reconnecting.received({.kind = Kind::opened});
  EXPECT_TRUE(reconnecting.lost(start)) << "the first time";
  EXPECT_TRUE(reconnecting.pause(start));
  EXPECT_FALSE(reconnecting.pause(start + seconds(31)));
  reconnecting.connected();
  reconnecting.received({.kind = Kind::opened});
  EXPECT_FALSE(reconnecting.lost(start + seconds(20)));
  EXPECT_FALSE(reconnecting.pause(start + seconds(31)));
  reconnecting.connected();
  EXPECT_TRUE(reconnecting.lost(start + seconds(20))) << "it was not opened: the server may be starting";
  EXPECT_TRUE(reconnecting.pause(start + seconds(31)));
  reconnecting.connected();
  reconnecting.received({.kind = Kind::opened});
  reconnecting.received({.kind = Kind::batch, .updates = 7});
  EXPECT_TRUE(reconnecting.lost(start + seconds(60)));
  EXPECT_TRUE(reconnecting.pause(start + seconds(70)));
}

}  // namespace
}  // namespace intervale
