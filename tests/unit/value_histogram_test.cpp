#include "server/builder/value_histogram.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/builder/value_steps.h"
#include "tests/support/analytic_fields.h"

namespace intervale {
namespace {

ValueHistogram histogram(const Volume& volume, std::optional<double> step = {}) {
  const auto format = choose_value_format(volume, step);
  EXPECT_TRUE(format) << format.error().message;
  ValueHistogram h = make_value_histogram(volume, *format);
  EXPECT_EQ(h.least, format->least());
  EXPECT_GE(h.count.size(), 1u);
  EXPECT_LE(h.count.size(), kMostBins);
  EXPECT_GT(h.width, 0);
  EXPECT_GT(h.count.front(), 0u);
  EXPECT_GT(h.count.back(), 0u);
  EXPECT_EQ(std::accumulate(h.count.begin(), h.count.end(), std::uint64_t(0)), volume.grid.sample_count());
  // The bins reach the greatest value, and one fewer would not.
  EXPECT_LE(format->greatest(), h.least + h.width * double(h.count.size()) * (1 + 1e-6));
  EXPECT_GE(format->greatest(), h.least + h.width * double(h.count.size() - 1) * (1 - 1e-6));
  return h;
}

template <class T>
Volume uniform(SampleType type, double from, double to, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(from, to);
  std::vector<T> samples(17 * 19 * 23);
  for (T& v : samples) v = T(std::is_integral_v<T> ? std::floor(any(random)) : any(random));
  return testing::volume_of_type(type, {17, 19, 23}, samples);
}

// Bin by bin, by comparison with its ends. Whole numbers: exact.
template <class T>
void expect_counts_of_whole_numbers(SampleType type, double from, double to) {
  SCOPED_TRACE(std::string(name_of(type)) + " from " + std::to_string(from) + " to " + std::to_string(to));
  const Volume volume = uniform<T>(type, from, to, 1);
  const ValueHistogram h = histogram(volume);
  EXPECT_EQ(h.width, std::floor(h.width));
  const auto samples = visit_samples(volume, [](auto all) { return std::vector<double>(all.begin(), all.end()); });
  const double span = *std::max_element(samples.begin(), samples.end()) - h.least;
  EXPECT_EQ(h.width, std::ceil((span + 1) / double(kMostBins)));
  for (std::size_t i = 0; i < h.count.size(); ++i) {
    const double begin = h.least + double(i) * h.width, end = begin + h.width;
    EXPECT_EQ(h.count[i], std::uint64_t(std::count_if(samples.begin(), samples.end(), [&](double v) { return begin <= v && v < end; })));
  }
}

TEST(ValueHistogram, WholeNumbersHaveBinsOfTheLeastWholeWidth) {
  expect_counts_of_whole_numbers<std::uint8_t>(SampleType::u8, 0, 256);
  expect_counts_of_whole_numbers<std::uint8_t>(SampleType::u8, 3, 90);
  expect_counts_of_whole_numbers<std::int8_t>(SampleType::i8, -128, 128);
  expect_counts_of_whole_numbers<std::uint16_t>(SampleType::u16, 0, 65536);
  expect_counts_of_whole_numbers<std::uint16_t>(SampleType::u16, 100, 400);
  expect_counts_of_whole_numbers<std::int16_t>(SampleType::i16, -1024, 3072);
  expect_counts_of_whole_numbers<std::uint32_t>(SampleType::u32, 0, 4294967296.0);
  expect_counts_of_whole_numbers<std::int32_t>(SampleType::i32, -2147483648.0, 2147483648.0);
}

TEST(ValueHistogram, MultiplesOfAStepHaveABinEach) {
  std::vector<float> samples(1000);
  for (int i = 0; i < 1000; ++i) samples[i] = float(0.1 * (i * i % 200 - 40));
  const ValueHistogram h = histogram(testing::volume_of_type(SampleType::f32, {10, 10, 10}, samples));
  EXPECT_EQ(h.width, 0.1);
  for (std::size_t i = 0; i < h.count.size(); ++i) {
    const auto value = float(0.1 * (double(i) - 40));
    EXPECT_EQ(h.count[i], std::uint64_t(std::count(samples.begin(), samples.end(), value))) << value;
  }
}

// A sample may be rounded across a bin's end by half a step.
TEST(ValueHistogram, FloatsAreCountedByTheirRoundedValues) {
  for (const std::optional<double> step : {std::optional<double>(), std::optional<double>(0), std::optional<double>(0.001)}) {
    Volume volume = uniform<float>(SampleType::f32, -3, 12, 2);
    const ValueHistogram h = histogram(volume, step);
    EXPECT_GT(h.count.size(), kMostBins / 2);
    const ValueFormat format = *choose_value_format(volume, step);
    round_samples(volume, format);
    EXPECT_EQ(make_value_histogram(volume, format), h);
    const auto samples = visit_samples(volume, [](auto all) { return std::vector<double>(all.begin(), all.end()); });
    std::uint64_t at_most = 0;
    for (std::size_t i = 0; i < h.count.size(); ++i) {
      at_most += h.count[i];
      const double end = h.least + double(i + 1) * h.width, room = h.width * 1e-5;
      EXPECT_GE(at_most, std::uint64_t(std::count_if(samples.begin(), samples.end(), [&](double v) { return v < end - room; })));
      EXPECT_LE(at_most, std::uint64_t(std::count_if(samples.begin(), samples.end(), [&](double v) { return v < end + room; })));
    }
  }
}

TEST(ValueHistogram, ConstantFieldsHaveOneBin) {
  const Volume bytes = testing::volume_of_type(SampleType::u8, {2, 2, 2}, std::vector<std::uint8_t>(8, 255));
  EXPECT_EQ(histogram(bytes), (ValueHistogram{255, 1, {8}}));
  const Volume floats = testing::volume_of_type(SampleType::f32, {2, 2, 2}, std::vector<float>(8, -0.5f));
  EXPECT_EQ(histogram(floats), (ValueHistogram{-0.5, 0.5, {8}}));
  EXPECT_EQ(make_value_histogram(floats, {SampleType::f32, 0, -0x3f000000, 0}), (ValueHistogram{-0.5, 1, {8}}));
}

TEST(ValueHistogram, DoesNotDependOnTheNumberOfThreads) {
  for (const Volume& volume : {uniform<std::uint16_t>(SampleType::u16, 0, 5000, 3), uniform<double>(SampleType::f64, -1, 1, 3)}) {
    const ValueHistogram h = histogram(volume);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(histogram(volume), h);
  }
}

}  // namespace
}  // namespace intervale
