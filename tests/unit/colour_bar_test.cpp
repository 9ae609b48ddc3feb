#include "common/picture/colour_bar.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "common/picture/text.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using Rgb = std::array<std::uint8_t, 3>;

Pixels white(int width, int height) { return {width, height, std::vector<std::uint8_t>(3 * std::size_t(width) * std::size_t(height), 255)}; }

Rgb at(const Pixels& p, int x, int y) {
  const auto* from = p.rgb.data() + 3 * (std::size_t(y) * std::size_t(p.width) + std::size_t(x));
  return {from[0], from[1], from[2]};
}

Description of_values(std::int64_t least, ValueKey count) {
  Description d;
  d.format = {.first = least, .last = count};
  return d;
}

TEST(ValueSpan, IsTheRangeAsFarAsThereAreValues) {
  const Description d = of_values(-10, 30);  // to 20
  EXPECT_EQ(span_of(d, {-5, 7}), (ValueSpan{-5, 7}));
  EXPECT_EQ(span_of(d, {-50, 7}), (ValueSpan{-10, 7}));
  EXPECT_EQ(span_of(d, {-kInf, kInf}), (ValueSpan{-10, 20}));
  EXPECT_EQ(span_of(d, {3, 3}), (ValueSpan{-10, 20}));
  EXPECT_EQ(span_of(d, {30, 40}), (ValueSpan{-10, 20}));
  EXPECT_EQ(span_of(of_values(4, 0), {1, 9}), (ValueSpan{4, 4}));
}

TEST(ValueSpan, PlacesValues) {
  const ValueSpan span{-10, 30};
  EXPECT_EQ(span.at(-10), 0);
  EXPECT_EQ(span.at(30), 1);
  EXPECT_EQ(span.at(0), 0.25);
  EXPECT_EQ(span.at(50), 1.5);
  EXPECT_EQ(span.at(-50), -1);
  EXPECT_EQ((ValueSpan{4, 4}).at(4), 0.5);
  constexpr double kMost = std::numeric_limits<double>::max();
  EXPECT_EQ((ValueSpan{-kMost, kMost}).at(kMost / 2), 0.75);
  EXPECT_EQ((ValueSpan{0, 1e-300}).at(kMost), 1e6);
  EXPECT_EQ((ValueSpan{-kMost, kMost}).middle(), 0);
}

TEST(ColourBar, GoesThroughThePalette) {
  for (const auto& [width, height] : {std::pair(1280, 960), {640, 480}, {300, 2000}, {4000, 300}}) {
    Pixels pixels = white(width, height);
    const Palette palette = find_palette("viridis").value();
    draw_colour_bar(pixels, palette, {150, 255}, "density, HU");
    const Palette::Bytes colours = palette.bytes();
    // The column with the most colours of the palette has both ends, and all are in its order.
    std::vector<std::size_t> longest;
    for (int x = 0; x < width; x += 8) {  // it is wider than this
      std::vector<std::size_t> seen;
      for (int y = 0; y < height; ++y) {
        const auto found = std::find(colours.begin(), colours.end(), at(pixels, x, y));
        if (found != colours.end()) seen.push_back(std::size_t(found - colours.begin()));
      }
      if (seen.size() > longest.size()) longest = seen;
    }
    ASSERT_NEAR(double(longest.size()), 0.4 * height, 2);
    EXPECT_EQ(longest.front(), 255u);
    EXPECT_EQ(longest.back(), 0u);
    EXPECT_TRUE(std::is_sorted(longest.rbegin(), longest.rend()));
  }
}

TEST(ColourBar, OfATinyPictureIsCutOff) {
  Pixels pixels = white(3, 2);
  draw_colour_bar(pixels, find_palette("grey").value(), {0, 1}, std::string(100, 'x'));
  EXPECT_EQ(pixels.rgb.size(), 18u);
}

TEST(ColourBar, HasTheFieldAndItsUnitAsTitle) {
  EXPECT_EQ(title_of("", ""), "");
  EXPECT_EQ(title_of("density", "HU"), "density, HU");
  EXPECT_EQ(title_of("density", ""), "density");
  EXPECT_EQ(title_of("", "HU"), "HU");
}

TEST(Text, IsCountedAndShortenedByCharacters) {
  EXPECT_EQ(text_length(""), 0);
  EXPECT_EQ(text_length("µm³"), 3);
  EXPECT_EQ(shortened("µm³", 3), "µm³");
  EXPECT_EQ(shortened("µm³/s", 4), "µ...");
  EXPECT_EQ(shortened("µm³/s", 3), "...");
  EXPECT_EQ(shortened("", 3), "");
}

// Every character of ASCII but the space has a picture of its own, within its place, in every size.
TEST(Text, TellsCharactersApart) {
  for (const double dot : {1.25, 2.0, 3.7}) {
    const int width = int(kAcross * dot) + 1, height = int(kDown * dot) + 1;
    const auto drawn = [&](std::string_view text) {
      Pixels pixels = white(width, height);
      draw_text(pixels, text, 0, 0, dot, {0, 0, 0});
      return std::string(pixels.rgb.begin(), pixels.rgb.end());
    };
    std::set<std::string> seen;
    for (char c = ' '; c <= '~'; ++c) {
      const std::string one = drawn(std::string(1, c));
      EXPECT_TRUE(seen.insert(one).second) << c;
      EXPECT_EQ(one == drawn(""), c == ' ') << c;
    }
    EXPECT_EQ(drawn("\u4e2d"), drawn("\U0001f600"));
    EXPECT_TRUE(seen.insert(drawn("\u4e2d")).second);
  }
}

TEST(Text, BeyondThePictureIsCutOff) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-80, 80);
  for (int i = 0; i < 100; ++i) {
    Pixels pixels = white(40, 20);
    draw_text(pixels, "Aµg(", place(random), place(random), 2, {0, 0, 0});
    EXPECT_EQ(pixels.rgb.size(), 2400u);
  }
}

}  // namespace
}  // namespace intervale
