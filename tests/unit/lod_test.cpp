#include "common/view/lod.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/special_values.h"

namespace intervale {
namespace {

Lod of_error(double error) { return {.error = error}; }
Lod of_percent(double percent) { return {.error_percent = percent}; }
Lod of_region(const Box& box) { return {.roi = box}; }

// From 10 in front of the origin, which it looks at.
constexpr Camera kCamera{.eye = {0, 0, -10}, .look_at = {0, 0, 0}};

template <class Change>
Lod seen(Change&& change) {
  Camera camera = kCamera;
  change(camera);
  return {.camera = camera};
}

TEST(CheckLod, PassesWhatMakesSense) {
  EXPECT_TRUE(check_lod({}));
  EXPECT_TRUE(check_lod(of_error(1e300)));
  EXPECT_TRUE(check_lod(of_percent(0)));
  EXPECT_TRUE(check_lod({0, 100.0, {}, {}, 0, 0}));
  EXPECT_TRUE(check_lod(of_region({{1, 2, 3}, {1, 2, 3}})));
}

TEST(CheckLod, RefusesWhatDoesNot) {
  const Lod senseless[] = {of_error(-1),
                           of_error(kNan),
                           of_error(kInf),
                           of_percent(-0.1),
                           of_percent(100.1),
                           of_percent(kNan),
                           of_percent(kInf),
                           of_region({{0, 0, 2}, {1, 1, 1}}),
                           of_region({{0, kNan, 0}, {1, 1, 1}}),
                           of_region({{0, 0, 0}, {1, 1, kNan}}),
                           of_region({{-kInf, 0, 0}, {1, 1, 1}}),
                           of_region({{0, 0, 0}, {1, kInf, 1}})};
  for (const Lod& lod : senseless) {
    const auto checked = check_lod(lod);
    ASSERT_FALSE(checked) << "number " << &lod - senseless;
    EXPECT_TRUE(checked.error().usage);
  }
}

TEST(CheckLod, PassesCamerasThatSeeSomething) {
  EXPECT_TRUE(check_lod({.camera = kCamera}));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.eye = {1e150, 0, 0}; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.eye = {0, 0, -1e-150}; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.up = {0, 1e-9, 0}; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.up = {0, 1, 1e3}; }))) << "up need not stand upright on the line of sight";
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.fov = 1e-3; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.fov = 179.999; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.viewport = {1, 65535}; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.pixel_error = 1e-300; })));
  EXPECT_TRUE(check_lod(seen([](Camera& c) { c.pixel_error = 1e300; })));
}

// Each with what the refusal must say.
TEST(CheckLod, RefusesCamerasThatSeeNothing) {
  std::vector<std::pair<Lod, std::string>> senseless;
  const auto refuse = [&senseless](const std::string& about, auto&& change) { senseless.emplace_back(seen(change), about); };
  for (const double wrong : {kNan, kInf, -kInf}) {
    for (const auto vector : {&Camera::eye, &Camera::look_at, &Camera::up}) {
      for (std::size_t i = 0; i < 3; ++i) refuse("finite", [&](Camera& c) { (c.*vector)[i] = wrong; });
    }
    refuse("field of view", [&](Camera& c) { c.fov = wrong; });
    refuse("pixel error", [&](Camera& c) { c.pixel_error = wrong; });
  }
  refuse("another point", [](Camera& c) { c.eye = c.look_at; });
  refuse("another point", [](Camera& c) { c.eye = {-1e308, 0, 0}, c.look_at = {1e308, 0, 0}; });  // whose difference is infinite
  refuse("up", [](Camera& c) { c.up = {0, 0, 0}; });
  refuse("up", [](Camera& c) { c.up = {0, 0, 1}; });
  refuse("up", [](Camera& c) { c.up = {0, 0, -1e6}; });
  refuse("up", [](Camera& c) { c.eye = {1, 2, 3}, c.look_at = {2, 4, 6}, c.up = {-0.1, -0.2, -0.3}; });
  for (const double fov : {0.0, -45.0, 180.0, 360.0, -0.0}) refuse("field of view", [&](Camera& c) { c.fov = fov; });
  for (const int pixels : {0, -1, 65536, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()}) {
    for (std::size_t i = 0; i < 2; ++i) refuse("viewport", [&](Camera& c) { c.viewport[i] = pixels; });
  }
  for (const double pixels : {0.0, -1.0}) refuse("pixel error", [&](Camera& c) { c.pixel_error = pixels; });
  for (std::size_t i = 0; i < senseless.size(); ++i) {
    const auto checked = check_lod(senseless[i].first);
    ASSERT_FALSE(checked) << "number " << i << ", " << senseless[i].second;
    EXPECT_TRUE(checked.error().usage);
    EXPECT_NE(checked.error().message.find(senseless[i].second), std::string::npos) << "number " << i << ": " << checked.error().message;
    EXPECT_EQ(checked.error().message.find('\n'), std::string::npos);
  }
}

// A camera does not make up for the rest.
TEST(CheckLod, ChecksAllOfIt) {
  for (Lod lod : {of_error(-1), of_percent(kNan), of_region({{0, 0, 2}, {1, 1, 1}})}) {
    lod.camera = kCamera;
    EXPECT_FALSE(check_lod(lod));
  }
}

}  // namespace
}  // namespace intervale
