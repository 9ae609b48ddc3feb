#include "common/view/transfer_function.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "tests/support/cameras.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

using testing::uniform;

TEST(OpacityCurve, IsReadFromText) {
  EXPECT_EQ(parse_opacity("5:1").value(), (OpacityCurve{{5, 1}}));
  EXPECT_EQ(parse_opacity("-1e3:0,0.5:0.25,7:1").value(), (OpacityCurve{{-1000, 0}, {0.5, 0.25}, {7, 1}}));
}

TEST(OpacityCurve, WhatIsNoneIsOneLine) {
  for (const std::string text : {"", ",", "5", "5:", ":1", "5:1,", "5:0.1,6", "5:x", "x:0.5", "nan:0.5", "5:nan", "inf:1", "5:0.1 6:0.2", "5:0.1:2",
                                 "5:-0.1", "5:1.1", "5:0,5:1", "6:0,5:1"}) {
    const auto read = parse_opacity(text);
    ASSERT_FALSE(read) << text;
    EXPECT_TRUE(read.error().usage);
    EXPECT_EQ(read.error().message.find('\n'), std::string::npos);
  }
  std::string many = "0:0";
  for (std::size_t i = 1; i <= kMaxOpacityPoints; ++i) many += "," + std::to_string(i) + ":0";
  EXPECT_THAT(parse_opacity(many).error().message, HasSubstr("256"));
  many.resize(many.rfind(','));
  EXPECT_EQ(parse_opacity(many).value().size(), kMaxOpacityPoints);
}

TEST(OpacityCurve, IsLinearBetweenPointsAndConstantBeyond) {
  const OpacityCurve curve{{10, 0.2}, {20, 0.6}, {40, 0}};
  for (const auto& [value, opacity] : {std::pair(-INFINITY, 0.2), {10.0, 0.2}, {15.0, 0.4}, {20.0, 0.6}, {30.0, 0.3}, {40.0, 0.0}, {1e300, 0.0}})
    EXPECT_DOUBLE_EQ(opacity_at(curve, value), opacity) << value;
  constexpr double kMost = std::numeric_limits<double>::max();
  EXPECT_DOUBLE_EQ(opacity_at({{-kMost, 0}, {kMost, 1}}, 0), 0.5);
}

// A length of constant opacity a, in any pieces, is opaque to 1 - (1 - a)^length.
TEST(TransferFunction, OfOneValueIsExponential) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const double opacity = uniform(random, 0, 0.9), length = std::pow(10, uniform(random, -3, 2));
    const TransferFunction transfer([&](double) { return TransferFunction::Optics{opacity, {0.3, 0.6, 0.9}}; });
    RayLight light;
    const int pieces = 1 + int(random() % 100);
    for (int j = 0; j < pieces; ++j) transfer.add(light, uniform(random, 0, 1), uniform(random, 0, 1), length / pieces);
    const double passes = std::pow(1 - opacity, length);
    EXPECT_NEAR(light.passes, passes, 2e-5);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(light.colour[k], 0.3 * double(k + 1) * (1 - passes), 2e-5);
  }
}

TEST(TransferFunction, OfOpacityOneAreFinite) {
  const TransferFunction transfer([](double) { return TransferFunction::Optics{1, {1, 0.5, 0}}; });
  RayLight light;
  transfer.add(light, 0, 1, 0.1);
  EXPECT_NEAR(light.passes, std::pow(1e-6, 0.1), 1e-5);
  transfer.add(light, 1, 0, 100);
  EXPECT_LT(light.passes, 1e-5);
  EXPECT_NEAR(light.colour[0], 1, 1e-5);
  EXPECT_NEAR(light.colour[1], 0.5, 1e-5);
}

TransferFunction::Optics waves(double place, const std::array<double, 4>& by) {
  const auto wave = [&](double from, std::size_t i) { return from + (1 - from) * (0.5 + 0.5 * std::sin(by[i] * place + double(i))); };
  return {0.9 * wave(0, 0) * wave(0, 3), {wave(0.1, 1), wave(0, 2), place}};
}

// The definition, in steps.
RayLight naive(const std::array<double, 4>& by, double from, double to, double length) {
  constexpr int kSteps = 20000;
  std::array<double, 3> colour{};
  double passes = 1;
  for (int i = 0; i < kSteps; ++i) {
    const auto optics = waves(from + (to - from) * (i + 0.5) / kSteps, by);
    const double absorbed = 1 - std::pow(1 - optics.opacity, length / kSteps);
    for (std::size_t k = 0; k < 3; ++k) colour[k] += passes * absorbed * optics.colour[k];
    passes *= 1 - absorbed;
  }
  return {{float(colour[0]), float(colour[1]), float(colour[2])}, float(passes)};
}

TEST(TransferFunction, AlongALineIsTheIntegral) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    std::array<double, 4> by;
    for (double& b : by) b = uniform(random, 0, 12);
    const TransferFunction transfer([&](double place) { return waves(place, by); });
    const double from = uniform(random, 0, 1), to = seed % 5 == 0 ? from : uniform(random, 0, 1), length = std::pow(10, uniform(random, -2, 2));
    RayLight light;
    transfer.add(light, from, to, length);
    const RayLight expected = naive(by, from, to, length);
    EXPECT_NEAR(light.passes, expected.passes, 1e-3);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(light.colour[k], expected.colour[k], 0.01);
  }
}

}  // namespace
}  // namespace intervale
