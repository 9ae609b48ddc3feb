#include "server/volume/samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>
#include <string>
#include <vector>

namespace intervale {
namespace {

std::span<const float> floats_of(const Volume& volume) {
  return {reinterpret_cast<const float*>(volume.bytes.data()), volume.bytes.size() / sizeof(float)};
}

// How many connected parts the samples within [low, high] have, neighbours along axes.
int parts(const Volume& volume, float low, float high) {
  const auto samples = floats_of(volume);
  const auto n = static_cast<std::size_t>(volume.grid.dims[0]);
  std::vector<bool> seen(samples.size());
  int count = 0;
  for (std::size_t start = 0; start < samples.size(); ++start) {
    std::queue<std::size_t> open;
    const auto visit = [&](std::size_t i) {
      if (seen[i] || samples[i] < low || samples[i] > high) return false;
      seen[i] = true;
      open.push(i);
      return true;
    };
    count += visit(start);
    for (; !open.empty(); open.pop()) {
      const auto i = open.front();
      if (i % n > 0) visit(i - 1);
      if (i % n + 1 < n) visit(i + 1);
      if (i / n % n > 0) visit(i - n);
      if (i / n % n + 1 < n) visit(i + n);
      if (i >= n * n) visit(i - n * n);
      if (i + n * n < samples.size()) visit(i + n * n);
    }
  }
  return count;
}

TEST(Samples, SpanTheCubeFromMinusOneToOne) {
  for (const auto name : sample_names())
    for (const int size : {2, 17, 40}) {
      SCOPED_TRACE(std::string(name) + " " + std::to_string(size));
      const auto volume = make_sample(name, size);
      ASSERT_TRUE(volume) << volume.error().message;
      EXPECT_EQ(volume->name, name);
      EXPECT_EQ(volume->type, SampleType::f32);
      const double spacing = 2.0 / (size - 1);
      EXPECT_EQ(volume->grid, (Grid{{size, size, size}, Affine::of({spacing, spacing, spacing}, {-1, -1, -1})}));
      ASSERT_EQ(volume->bytes.size(), volume->grid.sample_count() * 4);
      for (const float sample : floats_of(*volume)) ASSERT_TRUE(std::isfinite(sample));
    }
}

TEST(Samples, StayInTheirRangeAndUseIt) {
  for (const auto name : sample_names()) {
    SCOPED_TRACE(name);
    const auto volume = make_sample(name, 97);
    ASSERT_TRUE(volume);
    const auto samples = floats_of(*volume);
    const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
    const bool is_gyroid = name == "gyroid";
    EXPECT_GE(*low, is_gyroid ? -1.5001F : 0);
    EXPECT_LE(*high, is_gyroid ? 1.5001F : 255.5F);
    EXPECT_LE(*low, is_gyroid ? -1.4F : 2);
    EXPECT_GE(*high, is_gyroid ? 1.4F : 235);
  }
}

TEST(Samples, AreTheSameEveryTime) {
  for (const auto name : sample_names()) EXPECT_EQ(make_sample(name, 33)->bytes, make_sample(name, 33)->bytes) << name;
}

// Above the bonds' 150 the atoms lie apart, sixty of them; from 128 on the bonds join them into one cage around an
// empty middle.
TEST(Samples, BuckyballHasSixtyAtomsJoinedIntoOneCage) {
  const auto volume = make_sample("buckyball", 129);
  ASSERT_TRUE(volume);
  EXPECT_EQ(parts(*volume, 200, 256), 60);
  EXPECT_EQ(parts(*volume, 128, 256), 1);
  EXPECT_EQ(parts(*volume, 128, 188), 1);
  EXPECT_LT(floats_of(*volume)[64 + 129 * (64 + 129 * 64)], 1);
}

TEST(Samples, UnknownNamesAndSizesAreMisuse) {
  for (const auto& volume :
       {make_sample("teapot", 64), make_sample("", 64), make_sample("gyroid", 1), make_sample("gyroid", 1025), make_sample("gyroid", -5)}) {
    ASSERT_FALSE(volume);
    EXPECT_TRUE(volume.error().usage);
  }
  EXPECT_NE(make_sample("teapot", 64).error().message.find("marschner-lobb"), std::string::npos);
}

}  // namespace
}  // namespace intervale
