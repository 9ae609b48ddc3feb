#include "common/codec/value_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace intervale {
namespace {

constexpr double kMostValue = std::numeric_limits<double>::max(), kLeastValue = 5e-324;

std::vector<std::vector<double>> tables() {
  std::vector<double> random;
  std::mt19937 numbers(3);
  for (int i = 0; i < 1000; ++i) random.push_back(std::ldexp(double(numbers()) - 2e9, int(numbers() % 1900) - 1000));
  std::sort(random.begin(), random.end());
  random.erase(std::unique(random.begin(), random.end()), random.end());
  return {{0}, {-kMostValue, kMostValue}, {-kMostValue, -1, -kLeastValue, 0, kLeastValue, 2 * kLeastValue, 1, kMostValue}, random};
}

TEST(ValueTable, ComesBackTheSame) {
  for (const auto& table : tables()) {
    const auto back = decode_value_table(encode_value_table(table), table.size());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, table);
  }
}

TEST(ValueTable, TruncationsOtherCountsAndAdditionsAreRefused) {
  for (const auto& table : tables()) {
    auto bytes = encode_value_table(table);
    for (std::size_t n = 0; n < bytes.size(); ++n)
      EXPECT_FALSE(decode_value_table(std::vector(bytes.begin(), bytes.begin() + std::ptrdiff_t(n)), table.size()));
    for (const std::size_t count : {table.size() - 1, table.size() + 1, std::size_t(1) << 32}) EXPECT_FALSE(decode_value_table(bytes, count));
    bytes.push_back(0);
    EXPECT_FALSE(decode_value_table(bytes, table.size()));
  }
}

TEST(ValueTable, KeysAreThoseOfTheNearestValues) {
  for (const auto& table : tables()) {
    const ValueFormat format = format_of_table(SampleType::f64, table);
    ASSERT_TRUE(check_value_format(format));
    for (ValueKey key = 0; key < table.size(); ++key) {
      EXPECT_EQ(format.value(key), table[key]);
      EXPECT_EQ(format.key(table[key]), key);
    }
    EXPECT_EQ(format.key(-kMostValue), 0u);
    EXPECT_EQ(format.key(kMostValue), format.last);
  }
  const ValueFormat format = format_of_table(SampleType::i32, {-10, 0, 1, 4});
  EXPECT_EQ(format.key(-5.5), 0u);
  EXPECT_EQ(format.key(-5), 1u) << "half up";
  EXPECT_EQ(format.key(2.4), 2u);
  EXPECT_EQ(format.key(2.5), 3u);
}

TEST(ValueTable, TablesThatAreNoneAreRefused) {
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  using Table = std::vector<double>;
  for (const Table& table : {Table{0, 0}, Table{1, 0}, Table{0, nan}, Table{nan}, Table{-infinity, 0}, Table{0, infinity}, Table{-1, -0.0, 1}}) {
    EXPECT_FALSE(check_value_format(format_of_table(SampleType::f64, table)));
  }
  const ValueFormat good = format_of_table(SampleType::f64, {0, 1, 5});
  EXPECT_TRUE(check_value_format(good));
  const auto is_refused = [&good](auto&& change) {
    ValueFormat format = good;
    change(format);
    return !check_value_format(format);
  };
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.last = 1; }));
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.last = 3; }));
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.first = 1; }));
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.step = 1; }));
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.type = SampleType::f32; }));
  EXPECT_TRUE(is_refused([](ValueFormat& f) { f.table = nullptr; }));
}

TEST(ValueTable, FormatsAreEqualIfTheirContentsAre) {
  const ValueFormat a = format_of_table(SampleType::f64, {0, 1, 5}), b = format_of_table(SampleType::f64, {0, 1, 5});
  EXPECT_EQ(a, b);
  EXPECT_NE(a, format_of_table(SampleType::f64, {0, 2, 5}));
  EXPECT_NE(a, (ValueFormat{SampleType::f64, 0, 0, 2}));
}

}  // namespace
}  // namespace intervale
