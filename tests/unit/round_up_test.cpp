#include "common/util/round_up.h"

#include <gtest/gtest.h>

#include <random>

namespace intervale {
namespace {

TEST(RoundUp, IsTheLeastFloatThatIsNoLess) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    const double value = std::ldexp(double(random()), int(random() % 280) - 220);
    const float up = round_up(value);
    EXPECT_GE(double(up), value);
    EXPECT_TRUE(up == 0 || double(std::nextafter(up, 0.0f)) < value) << value;
  }
}

TEST(RoundUp, KeepsFloatsAndStaysFinite) {
  constexpr float kMost = std::numeric_limits<float>::max();
  for (const float value : {0.0f, 1e-45f, 1.0f, kMost}) EXPECT_EQ(round_up(double(value)), value);
  EXPECT_EQ(round_up(1e-300), 1e-45f);
  EXPECT_EQ(round_up(1e300), kMost);
  EXPECT_EQ(round_up(std::numeric_limits<double>::infinity()), kMost);
}

}  // namespace
}  // namespace intervale
