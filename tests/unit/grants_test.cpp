#include "client/net/grants.h"

#include <gtest/gtest.h>

namespace intervale {
namespace {

TEST(Grants, AWindowIsOpenedAgainInQuarters) {
  Grants grants(UINT64_MAX, 8000);
  EXPECT_EQ(grants.take(), 8000u);
  EXPECT_EQ(grants.take(), 0u);
  EXPECT_TRUE(grants.spend(1999));
  EXPECT_EQ(grants.take(), 0u);
  EXPECT_TRUE(grants.spend(1));
  EXPECT_EQ(grants.take(), 2000u);
  EXPECT_FALSE(grants.exhausted());
}

TEST(Grants, MoreThanWasGrantedIsNotToBeSpent) {
  Grants grants(UINT64_MAX, 8000);
  EXPECT_FALSE(grants.spend(1));
  EXPECT_EQ(grants.take(), 8000u);
  EXPECT_FALSE(grants.spend(8001));
  EXPECT_TRUE(grants.spend(8000));
}

TEST(Grants, ABudgetIsGrantedToItsEnd) {
  Grants grants(9000, 8000);
  EXPECT_EQ(grants.take(), 8000u);
  EXPECT_TRUE(grants.spend(7000));
  EXPECT_EQ(grants.take(), 1000u);  // less than a quarter, but all there is
  EXPECT_FALSE(grants.exhausted());
  EXPECT_TRUE(grants.spend(1000));
  EXPECT_TRUE(grants.exhausted());
}

TEST(Grants, ANewSessionIsGrantedWhatTheOldOneDidNotSpend) {
  Grants grants(9000, 8000);
  EXPECT_EQ(grants.take(), 8000u);
  EXPECT_TRUE(grants.spend(3000));
  grants.forget_outstanding();
  EXPECT_EQ(grants.take(), 6000u);
}

}  // namespace
}  // namespace intervale
