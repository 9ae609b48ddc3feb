#include "client/core/backoff.h"

#include <gtest/gtest.h>

#include <algorithm>

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

}  // namespace
}  // namespace intervale
