#include "common/patch/key_sides.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/special_values.h"

namespace intervale {
namespace {

void expect_sides(const ValueFormat& format, const Range& range, const std::vector<ValueKey>& keys) {
  const KeySides sides(format, range);
  for (const ValueKey key : keys) {
    ASSERT_EQ(sides.side(key), side_of(format.value(key), range))
        << "key " << key << " of value " << format.value(key) << " in [" << range.alpha << ", " << range.beta << "]";
  }
}

TEST(KeySides, AreThoseOfTheValues) {
  std::mt19937 random(7);
  const std::int64_t largest = 0x7f7fffff;
  for (const ValueFormat& format :
       {ValueFormat{SampleType::u8, 1, 0, 255}, ValueFormat{SampleType::i16, 1, -300, 700}, ValueFormat{SampleType::f32, 0, -largest, 4278190078u},
        ValueFormat{SampleType::f32, 0.1, -17, 1000}, ValueFormat{SampleType::f64, 0.25, -9, 90}, ValueFormat{SampleType::u32, 1, 0, 4294967294u},
        ValueFormat{SampleType::u8, 1, 5, 0}}) {
    std::vector<ValueKey> keys{0, format.last};
    for (int i = 0; i < 200; ++i) keys.push_back(ValueKey(random() % (std::uint64_t(format.last) + 1)));
    for (int i = 0; i < 200; ++i) {
      double alpha = format.value(keys[random() % keys.size()]), beta = format.value(keys[random() % keys.size()]);
      if (random() % 3 == 0) alpha = std::nextafter(alpha, random() % 2 == 0 ? kInf : -kInf);
      if (random() % 3 == 0) beta = std::nextafter(beta, random() % 2 == 0 ? kInf : -kInf);
      if (random() % 9 == 0) alpha = -kInf;
      if (random() % 9 == 0) beta = kInf;
      if (alpha > beta) std::swap(alpha, beta);
      expect_sides(format, {alpha, beta}, keys);
    }
    expect_sides(format, {format.greatest() + 1, kInf}, keys);
    expect_sides(format, {-kInf, format.least() - 1}, keys);
  }
}

}  // namespace
}  // namespace intervale
