#include "common/view/palette.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/util/vec3.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

// G. M. Machado, M. M. Oliveira and L. A. F. Fernandes, A Physiologically-based Model for Simulation of Color Vision
// Deficiency, IEEE TVCG 15(6), 2009: without the cones for medium wavelengths. Of linear light.
constexpr std::array<Vec3, 3> kDeuteranopia{{{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}}};
constexpr std::array<Vec3, 3> kEverything{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

// CIELAB of an sRGB colour as it is seen.
Vec3 lab(const Palette::Colour& colour, const std::array<Vec3, 3>& vision) {
  Vec3 light, seen;
  for (std::size_t k = 0; k < 3; ++k) light[k] = colour[k] <= 0.04045 ? colour[k] / 12.92 : std::pow((colour[k] + 0.055) / 1.055, 2.4);
  for (std::size_t k = 0; k < 3; ++k) seen[k] = std::max(0.0, dot(vision[k], light));
  const Vec3 xyz{dot({0.4124, 0.3576, 0.1805}, seen) / 0.9505, dot({0.2126, 0.7152, 0.0722}, seen), dot({0.0193, 0.1192, 0.9505}, seen) / 1.089};
  const auto f = [](double v) { return v > 216.0 / 24389 ? std::cbrt(v) : (24389.0 / 27 * v + 16) / 116; };
  return {116 * f(xyz[1]) - 16, 500 * (f(xyz[0]) - f(xyz[1])), 200 * (f(xyz[1]) - f(xyz[2]))};
}

class PaletteOf : public ::testing::TestWithParam<std::string_view> {
 protected:
  Palette palette_ = find_palette(GetParam()).value();
};

TEST_P(PaletteOf, BecomesLighterWithEachStep) {
  for (const auto& vision : {kEverything, kDeuteranopia}) {
    Vec3 last = lab(palette_.at(0), vision);
    for (int i = 1; i < 256; ++i) {
      const Vec3 here = lab(palette_.at(i / 255.0), vision);
      EXPECT_GT(here[0], last[0] + 0.15) << i;
      EXPECT_LT(length(subtract(here, last)), 2.0) << i;  // a difference of 2.3 is just noticeable
      last = here;
    }
  }
}

TEST_P(PaletteOf, HasEighthsThatDifferForEverybody) {
  for (const auto& vision : {kEverything, kDeuteranopia}) {
    for (int i = 0; i < 8; ++i) {
      EXPECT_GT(length(subtract(lab(palette_.at(i / 8.0), vision), lab(palette_.at((i + 1) / 8.0), vision))), 10) << i;
    }
    EXPECT_GT(lab(palette_.at(1), vision)[0] - lab(palette_.at(0), vision)[0], 70);
  }
}

TEST_P(PaletteOf, EndsWhereNumbersEnd) {
  EXPECT_EQ(palette_.at(-0.1), palette_.at(0));
  EXPECT_EQ(palette_.at(-kInf), palette_.at(0));
  EXPECT_EQ(palette_.at(std::nan("")), palette_.at(0));
  EXPECT_EQ(palette_.at(1.1), palette_.at(1));
  EXPECT_EQ(palette_.at(kInf), palette_.at(1));
}

TEST_P(PaletteOf, HasTheSameColoursAsBytes) {
  const Palette::Bytes bytes = palette_.bytes();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(bytes[i][k], 255 * palette_.at(double(i) / 255)[k], 0.5);
  }
}

INSTANTIATE_TEST_SUITE_P(All, PaletteOf, ::testing::ValuesIn(kPaletteNames), [](const auto& palette) { return std::string(palette.param); });

// As their authors published them.
TEST(Palettes, BeginAndEndWithPublishedColours) {
  struct Ends {
    std::string_view name;
    std::array<std::uint8_t, 3> first, last;
  };
  for (const Ends& ends :
       {Ends{"viridis", {68, 1, 84}, {253, 231, 37}}, Ends{"cividis", {0, 32, 77}, {255, 234, 70}}, Ends{"inferno", {0, 0, 4}, {252, 255, 164}},
        Ends{"ice", {4, 6, 19}, {234, 253, 253}}, Ends{"grey", {0, 0, 0}, {255, 255, 255}}}) {
    const Palette::Bytes bytes = find_palette(ends.name)->bytes();
    EXPECT_EQ(bytes.front(), ends.first) << ends.name;
    EXPECT_EQ(bytes.back(), ends.last) << ends.name;
  }
  // The middle of viridis, and what grey has everywhere.
  const auto middle = find_palette("viridis")->bytes()[128];
  EXPECT_NEAR(middle[0], 33, 2);
  EXPECT_NEAR(middle[1], 145, 2);
  EXPECT_NEAR(middle[2], 140, 2);
  const Palette::Bytes grey = find_palette("grey")->bytes();
  for (std::size_t i = 0; i < grey.size(); ++i) EXPECT_EQ(grey[i][1], i);
}

TEST(Palettes, OfOtherNamesAreNone) {
  EXPECT_FALSE(find_palette(""));
  EXPECT_FALSE(find_palette("Viridis"));
  EXPECT_EQ(palette_list(), "viridis, cividis, inferno, ice or grey");
}

}  // namespace
}  // namespace intervale
