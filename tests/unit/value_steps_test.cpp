#include "server/builder/value_steps.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/patch/visit_samples.h"
#include "tests/support/analytic_fields.h"

namespace intervale {
namespace {

// A row of boxes holds the samples; the rest repeats the last one.
template <class T>
Volume volume_with(SampleType type, std::vector<T> samples) {
  const std::array<std::int32_t, 3> dims{std::int32_t((samples.size() + 3) / 4 + 1), 2, 2};
  samples.resize(std::size_t(dims[0]) * 4, samples.back());
  return testing::volume_of_type(type, dims, samples);
}
Volume floats(const std::vector<float>& samples) { return volume_with(SampleType::f32, samples); }
Volume doubles(const std::vector<double>& samples) { return volume_with(SampleType::f64, samples); }

std::vector<double> samples_of(const Volume& volume) {
  return visit_samples(volume, [](auto samples) { return std::vector<double>(samples.begin(), samples.end()); });
}

// Largest distance of a sample and the value of its key. Also checks the keys against ValueFormat::key, and that
// rounding the volume's samples gives the values of the keys.
double worst_error(const Volume& volume, const ValueFormat& format) {
  EXPECT_TRUE(check_value_format(format)) << check_value_format(format).error().message;
  const std::vector<double> samples = samples_of(volume);
  const std::vector<ValueKey> keys = keys_of(volume, format);
  Volume rounded = volume;
  round_samples(rounded, format);
  const std::vector<double> values = samples_of(rounded);
  EXPECT_EQ(keys.size(), samples.size());
  double worst = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(keys[i], format.key(samples[i]));
    EXPECT_LE(keys[i], format.last);
    EXPECT_EQ(values[i], format.value(keys[i]));
    EXPECT_FALSE(values[i] == 0 && std::signbit(values[i]));
    worst = std::max(worst, std::fabs(values[i] - samples[i]));
  }
  EXPECT_EQ(*std::min_element(keys.begin(), keys.end()), 0u);
  return worst;
}

ValueFormat chosen(const Volume& volume, std::optional<double> step = {}) {
  const auto format = choose_value_format(volume, step);
  EXPECT_TRUE(format) << format.error().message;
  return format.value_or(ValueFormat{});
}

std::string refusal(const Volume& volume, double step) {
  const auto format = choose_value_format(volume, step);
  EXPECT_FALSE(format) << "step " << format.value_or(ValueFormat{}).step;
  if (format) return {};
  EXPECT_TRUE(format.error().usage);
  EXPECT_EQ(format.error().message.find('\n'), std::string::npos);
  return format.error().message;
}

template <class T>
void expect_whole_numbers(SampleType type, std::mt19937& random) {
  using Limits = std::numeric_limits<T>;
  std::vector<T> some(500);
  for (T& v : some) v = T(random());
  const T least = T(Limits::min() + T(sizeof(T) == 4));  // 2^32 - 1 values at most
  for (T& v : some) v = std::max(v, least);
  for (const auto& samples : {some, std::vector<T>{least, Limits::max()}, std::vector<T>(8, Limits::min()), std::vector<T>(8, T(7))}) {
    const Volume volume = volume_with(type, samples);
    for (const std::optional<double> step : {std::optional<double>(), std::optional<double>(0), std::optional<double>(1)}) {
      const ValueFormat format = chosen(volume, step);
      EXPECT_EQ(format.step, 1);
      EXPECT_EQ(worst_error(volume, format), 0);
      EXPECT_EQ(format.greatest(), double(*std::max_element(samples.begin(), samples.end())));
    }
    for (const double step : {2.0, 0.5, -1.0, double(NAN), double(INFINITY)}) EXPECT_NE(refusal(volume, step).find(name_of(type)), std::string::npos);
  }
}

TEST(ValueSteps, WholeNumbersAreExactAndTakeNoOtherStep) {
  std::mt19937 random(1);
  expect_whole_numbers<std::uint8_t>(SampleType::u8, random);
  expect_whole_numbers<std::int8_t>(SampleType::i8, random);
  expect_whole_numbers<std::uint16_t>(SampleType::u16, random);
  expect_whole_numbers<std::int16_t>(SampleType::i16, random);
  expect_whole_numbers<std::uint32_t>(SampleType::u32, random);
  expect_whole_numbers<std::int32_t>(SampleType::i32, random);
  const Volume all =
      volume_with(SampleType::i32, std::vector<std::int32_t>{std::numeric_limits<std::int32_t>::min(), 7, std::numeric_limits<std::int32_t>::max()});
  for (const std::optional<double> step : {std::optional<double>(), std::optional<double>(0), std::optional<double>(1)}) {
    const ValueFormat format = chosen(all, step);
    ASSERT_NE(format.table, nullptr);
    EXPECT_EQ(format.last, 2u);
    EXPECT_EQ(worst_error(all, format), 0);
  }
}

// Whole numbers that multiply a step: `count` of them within `span` steps from `first` on, both ends among them.
std::vector<std::int64_t> multiples(std::int64_t first, std::uint32_t span, std::size_t count, std::mt19937& random) {
  std::vector<std::int64_t> k{first, first + span};
  while (k.size() < count) k.push_back(first + std::int64_t(random() % (span + 1)));
  std::shuffle(k.begin(), k.end(), random);
  return k;
}

TEST(ValueSteps, FindTheStepThatMadeTheFloats) {
  for (unsigned seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const double steps[]{1,
                         0.1,
                         double(0.1f),
                         double(1.1f),
                         1.0 / 64,
                         1.0 / 3,
                         0.001,
                         25,
                         1e-30,
                         3.3e20,
                         double(float(random()) * 1e-5f),
                         0.5 + double(random()) * 1e-10};
    const double step = steps[seed % std::size(steps)];
    const std::uint32_t span = 1 + std::uint32_t(random() % (seed % 5 == 0 ? 0xffff : 0x100));
    const std::int64_t firsts[]{0, -std::int64_t(span / 2), 1, -std::int64_t(span) - 7, 1000, 300000};
    const std::int64_t first = firsts[random() % (seed % 5 == 0 ? 5 : 6)];  // far from 0 only with a small span
    std::vector<float> f32;
    std::vector<double> f64;
    for (const std::int64_t k : multiples(first, span, 2 + random() % 2000, random)) {
      f32.push_back(float(double(k) * step));
      f64.push_back(double(k) * step);
    }
    for (const Volume& volume : {floats(f32), doubles(f64)}) {
      const ValueFormat format = chosen(volume);
      EXPECT_EQ(worst_error(volume, format), 0) << name_of(volume.type) << " step " << step << " first " << first << " span " << span << ", found "
                                                << format.step;
      EXPECT_LE(format.last, span);
      EXPECT_EQ(chosen(volume, 0), format);
    }
  }
}

TEST(ValueSteps, AStepIsTheSimplestNumber) {
  const auto step_of = [](auto value_of) {
    std::vector<float> samples;
    for (int k = -300; k < 1000; ++k) samples.push_back(value_of(k));
    return chosen(floats(samples)).step;
  };
  EXPECT_EQ(step_of([](int k) { return float(k); }), 1);
  EXPECT_EQ(step_of([](int k) { return float(3 * k); }), 3);
  EXPECT_EQ(step_of([](int k) { return float(k) / 64; }), 1.0 / 64);
  EXPECT_EQ(step_of([](int k) { return float(k) / 10; }), 0.1);
  EXPECT_EQ(step_of([](int k) { return float(k) / 3; }), 1.0 / 3);
  EXPECT_EQ(step_of([](int k) { return float(k * 0.0254); }), 0.0254);
  EXPECT_EQ(step_of([](int k) { return float(k) * 0.1f; }), double(0.1f));
  EXPECT_EQ(step_of([](int k) { return float(k) * 1.1f; }), double(1.1f));
}

TEST(ValueSteps, MultiplesOfAPowerOfTwoHaveAStepHoweverFarFromZero) {
  std::vector<float> samples(1000);
  for (int k = 0; k < 1000; ++k) samples[k] = 16777216.0f - 2000.0f + float(k * k % 997);
  EXPECT_EQ(worst_error(floats(samples), chosen(floats(samples))), 0);
  EXPECT_LT(chosen(floats(samples)).last, 997u);
  const std::vector<float> tiny{1e-45f, 0, 7e-45f, -1e-44f};
  EXPECT_EQ(worst_error(floats(tiny), chosen(floats(tiny))), 0);
}

TEST(ValueSteps, ConstantFieldsAreExact) {
  for (const float value : {0.0f, -0.0f, 1.0f, -0.1f, 3e38f, -1e-45f}) {
    for (const Volume& volume : {floats(std::vector<float>(8, value)), doubles(std::vector<double>(8, double(value)))}) {
      for (const std::optional<double> step : {std::optional<double>(), std::optional<double>(0)}) {
        const ValueFormat format = chosen(volume, step);
        EXPECT_EQ(format.last, 0u);
        EXPECT_EQ(worst_error(volume, format), 0);
      }
    }
  }
}

std::vector<double> noise(std::size_t count, double from, double to, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(from, to);
  std::vector<double> samples(count);
  for (double& v : samples) v = any(random);
  return samples;
}

TEST(ValueSteps, OtherFloatsTakeAPowerOfTwo) {
  const std::pair<double, double> ranges[]{{0, 1}, {-5, 5}, {1e6, 1e6 + 1}, {-1e-3, 1e9}, {1e-40, 2e-38}, {-3e38, 3e38}, {0, 1e-42}};
  for (const auto& [from, to] : ranges) {
    for (const std::size_t count : {std::size_t(3000), std::size_t(90000)}) {
      const std::vector<double> f64 = noise(count, from, to, 3);
      for (const Volume& volume : {doubles(f64), floats({f64.begin(), f64.end()})}) {
        SCOPED_TRACE(std::to_string(count) + " " + name_of(volume.type) + " from " + std::to_string(from) + " to " + std::to_string(to));
        const ValueFormat format = chosen(volume);
        const std::vector<double> samples = samples_of(volume);
        const double span = *std::max_element(samples.begin(), samples.end()) - *std::min_element(samples.begin(), samples.end());
        const double worst = worst_error(volume, format);
        if (worst == 0 && format.last < 65536) continue;
        int exponent = 0;
        EXPECT_EQ(std::frexp(format.step, &exponent), 0.5);
        EXPECT_LE(worst, format.step / 2);
        EXPECT_LE(format.last, 4097u);
        if (from != 1e6) {  // there the distance of numbers counts
          EXPECT_TRUE(format.step <= span * 0x1p-11 && format.step > span * 0x1p-12) << format.step;
        }
      }
    }
  }
}

TEST(ValueSteps, AStepThatIsAskedForRoundsToItsNearestMultiples) {
  const std::vector<double> f64 = noise(5000, -20, 70, 4);
  for (const Volume& volume : {doubles(f64), floats({f64.begin(), f64.end()})}) {
    for (const double step : {0.001, 0.1, 0.25, 3.0, 50.0, 1e6}) {
      const ValueFormat format = chosen(volume, step);
      EXPECT_EQ(format.step, step);
      const std::vector<ValueKey> keys = keys_of(volume, format);
      const std::vector<double> samples = samples_of(volume);
      for (std::size_t i = 0; i < keys.size(); ++i) {
        EXPECT_LE(std::fabs(double(format.first + keys[i]) * step - samples[i]), step / 2 * (1 + 1e-12));
      }
      EXPECT_LE(worst_error(volume, format), step / 2 * (1 + 1e-12) + 70 * 0x1p-24);
    }
  }
}

TEST(ValueSteps, StepZeroIsExactForF32) {
  for (const std::pair<double, double>& range : {std::pair<double, double>{0, 1}, {-5, 1e30}, {-3.4e38, 3.4e38}, {-1e-40, 1e-40}}) {
    std::vector<double> f64 = noise(5000, range.first, range.second, 5);
    f64[7] = -0.0;
    const Volume volume = floats({f64.begin(), f64.end()});
    EXPECT_EQ(worst_error(volume, chosen(volume, 0)), 0);
  }
}

TEST(ValueSteps, StepZeroForF64TakesAStepOrATable) {
  std::vector<double> some = noise(5000, 0, 1, 6);
  some[3] = -0.0;
  some[5] = 5e-324;
  EXPECT_EQ(worst_error(doubles(some), chosen(doubles(some), 0)), 0);
  EXPECT_NE(chosen(doubles(some), 0).table, nullptr);
  EXPECT_EQ(chosen(doubles(some)).table, nullptr);
  std::vector<double> many;
  std::mt19937 random(7);
  for (const std::int64_t k : multiples(-1000, 0xfffffffe, 100000, random)) many.push_back(double(k) * 0.3);
  const ValueFormat format = chosen(doubles(many), 0);
  EXPECT_EQ(format.last, 0xfffffffe);
  EXPECT_EQ(worst_error(doubles(many), format), 0);
}

TEST(ValueSteps, ImpossibleStepsAreRefused) {
  const Volume f32 = floats({0, 1, 1e6f}), f64 = doubles({0, 1, 1e6}), far = doubles({1e20, 1e20 + 1e6});
  for (const double step : {-1.0, double(NAN), double(INFINITY), -double(INFINITY)}) {
    EXPECT_NE(refusal(f32, step).find("not"), std::string::npos);
    EXPECT_NE(refusal(f64, step).find("not"), std::string::npos);
  }
  EXPECT_NE(refusal(f32, 1e-3).find("f32"), std::string::npos);
  EXPECT_NE(refusal(f64, 1e-4).find("2^32"), std::string::npos);
  EXPECT_NE(refusal(f64, 5e-324).find("2^53"), std::string::npos);
  EXPECT_NE(refusal(far, 1).find("2^53"), std::string::npos);
}

TEST(ValueSteps, TheGreatestNumbersStayFinite) {
  constexpr float kMost = std::numeric_limits<float>::max();
  std::vector<double> f64 = noise(90000, -1e38, 1e38, 8);
  std::vector<float> f32(f64.begin(), f64.end());
  f32[0] = kMost;
  f32[1] = -kMost;
  const ValueFormat format = chosen(floats(f32));
  EXPECT_LE(worst_error(floats(f32), format), format.step);
}

TEST(ValueSteps, DoNotDependOnTheNumberOfThreads) {
  const std::vector<double> f64 = noise(300000, -1, 1, 9);
  std::vector<float> few;
  few.reserve(f64.size());
  for (const double v : f64) few.push_back(float(std::round(v * 3000)) * 0.7f);
  for (const Volume& volume : {doubles(f64), floats(few)}) {
    const ValueFormat format = chosen(volume);
    const std::vector<ValueKey> keys = keys_of(volume, format);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(chosen(volume), format);
    EXPECT_EQ(keys_of(volume, format), keys);
  }
}

}  // namespace
}  // namespace intervale
