// Pictures as their users have them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

using Colour = std::array<int, 3>;

struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  [[nodiscard]] Colour at(int x, int y) const {
    const auto* p = rgb.data() + 3 * (std::size_t(y) * std::size_t(width) + std::size_t(x));
    return {p[0], p[1], p[2]};
  }
};

Image read_png(const std::filesystem::path& path) {
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  EXPECT_NE(png_image_begin_read_from_file(&head, path.c_str()), 0) << head.message;
  head.format = PNG_FORMAT_RGB;
  Image image{int(head.width), int(head.height), std::vector<std::uint8_t>(PNG_IMAGE_SIZE(head))};
  EXPECT_NE(png_image_finish_read(&head, nullptr, image.rgb.data(), 0, nullptr), 0) << head.message;
  return image;
}

enum class Hue { background, blue, orange, sand, other };

// The background is light and grey, nearly; sand is light and yellow.
Hue hue(const Colour& c) {
  const auto [r, g, b] = c;
  if (b > r + 30 && b > g + 15) return Hue::blue;
  if (r > b + 80 && r > g + 40) return Hue::orange;
  if (r > b + 25 && g > b + 15 && r > 110) return Hue::sand;
  if (std::min({r, g, b}) > 200 && std::max({r, g, b}) - std::min({r, g, b}) < 20) return Hue::background;
  return Hue::other;
}

double share(const Image& image, Hue wanted) {
  int count = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) count += hue(image.at(x, y)) == wanted ? 1 : 0;
  return double(count) / (image.width * image.height);
}

// The buckyball's shape would have to be known: a thick shell of a ball instead, in [0, 32]^3, alpha at radius 14 and
// beta at 8.
const std::filesystem::path& ball() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    std::string samples;
    for (int z = 0; z < 33; ++z)
      for (int y = 0; y < 33; ++y)
        for (int x = 0; x < 33; ++x) samples += char(std::lround(255 - 8 * std::hypot(x - 16, y - 16, z - 16)));
    const auto raw = folder.file("ball.raw", samples);
    const Finished built =
        run({program("intervale"), "build", raw, "--dims", "33", "33", "33", "--type", "u8", "--range", "143", "191", "-o", folder / "ball.ivm"});
    EXPECT_EQ(built.status, 0) << built.err;
    return folder / "ball.ivm";
  }();
  return path;
}

Finished extract(const std::filesystem::path& file, const std::string& options, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{program("intervale"), "extract", file};
  std::istringstream words(options);
  for (std::string word; words >> word;) arguments.push_back(word);
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run(arguments);
}

Image drawn(const std::filesystem::path& file, const std::string& options) {
  const TempDir folder;
  const Finished done = extract(file, options, {"--image", folder / "x.png"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("x.png"));
  Image image = read_png(folder / "x.png");
  EXPECT_EQ(done.err.empty(), share(image, Hue::background) < 1) << done.err;  // a warning
  return image;
}

TEST(Pictures, OfABallIsBlueInTheMiddle) {
  const Image image = drawn(ball(), "");
  EXPECT_EQ(image.width, 1280);
  EXPECT_EQ(image.height, 960);
  EXPECT_EQ(hue(image.at(640, 480)), Hue::blue);
  for (const auto& [x, y] : {std::pair(0, 0), {1279, 0}, {0, 959}, {1279, 959}}) EXPECT_EQ(hue(image.at(x, y)), Hue::background) << x << ' ' << y;
  EXPECT_EQ(share(image, Hue::orange), 0);
  EXPECT_GT(share(image, Hue::blue), 0.1);
}

// 32 units of height in 640 pixels at the depth of the middle, nearly: 20 pixels a unit.
TEST(Pictures, ACutShowsSandAroundOrange) {
  const std::string view = "--eye 16 16 916 --look-at 16 16 16 --fov 2.037 --viewport 800 640 --pixel-error 0.1 ";
  const Image whole = drawn(ball(), view);
  EXPECT_EQ(whole.width, 800);
  EXPECT_EQ(whole.height, 640);
  EXPECT_EQ(hue(whole.at(400, 320)), Hue::blue);
  EXPECT_EQ(hue(whole.at(400 + 260, 320)), Hue::blue);
  EXPECT_EQ(hue(whole.at(400 + 300, 320)), Hue::background);

  const Image cut = drawn(ball(), view + "--clip 16 16 16.3 0 0 1");
  EXPECT_EQ(hue(cut.at(400, 320)), Hue::orange);
  EXPECT_EQ(hue(cut.at(400 + 300, 320)), Hue::background);
  const double pixels = 800.0 * 640, ring = 3.14159 * (14 * 14 - 8 * 8) * 400 / pixels, hollow = 3.14159 * 64 * 400 / pixels;
  EXPECT_NEAR(share(cut, Hue::sand), ring, 0.25 * ring);       // less what the lines take
  EXPECT_NEAR(share(cut, Hue::orange), hollow, 0.2 * hollow);  // less its dark rim
  EXPECT_LT(share(cut, Hue::blue), 0.002);

  const Image away = drawn(ball(), view + "--clip 16 16 16 0 0 1 --roi 0 0 0 1 1 1 --error 1e9");  // hardly anything is left of it
  EXPECT_EQ(away.width, 800);
}

TEST(Pictures, FromWithinShowTheInsideOfABall) {
  const Image image = drawn(ball(), "--eye 16 16 16 --look-at 16 16 0 --viewport 200 200 --pixel-error 0.5");
  EXPECT_GT(share(image, Hue::orange), 0.9);
}

// A column of the picture that has a colour bar: from its first pixel of one colour down to its last of another, green
// never rises, as in all palettes. -1: there is none.
int column_of_bar(const Image& image, const Colour& top, const Colour& bottom) {
  for (int x = 0; x < image.width; ++x) {
    int first = 0;
    while (first < image.height && image.at(x, first) != top) ++first;
    int last = image.height - 1;
    while (last > first && image.at(x, last) != bottom) --last;
    if (last - first < image.height / 4) continue;
    int falls = 0, rises = 0;
    for (int y = first; y < last; ++y) {
      falls += image.at(x, y)[1] > image.at(x, y + 1)[1] ? 1 : 0;
      rises += image.at(x, y)[1] < image.at(x, y + 1)[1] ? 1 : 0;
    }
    if (rises == 0 && falls > 50) return x;
  }
  return -1;
}

TEST(Pictures, ByValueHaveColoursOfThePaletteAndABar) {
  const std::string view = "--error 0 --clip 16 16 16 0 0 1 --eye 16 16 916 --look-at 16 16 16 --fov 2.037 --viewport 800 640 --pixel-error 0.1 ";
  const Image by_surface = drawn(ball(), view), same = drawn(ball(), view + "--color-by surface");
  EXPECT_EQ(by_surface.rgb, same.rgb);
  EXPECT_EQ(column_of_bar(by_surface, {253, 231, 37}, {68, 1, 84}), -1);
  const Image viridis = drawn(ball(), view + "--color-by value");
  EXPECT_GT(column_of_bar(viridis, {253, 231, 37}, {68, 1, 84}), 600);
  EXPECT_GT(share(by_surface, Hue::orange), 0.1);
  EXPECT_EQ(share(viridis, Hue::orange), 0);
  const Image grey = drawn(ball(), view + "--color-by value --palette grey --color-span 143 191");
  EXPECT_GT(column_of_bar(grey, {255, 255, 255}, {0, 0, 0}), 600);
  // The cut becomes lighter from alpha, at a radius of 14, to beta at 8: 20 pixels a unit.
  const auto light = [&](double radius) {
    int sum = 0;
    for (const int sign : {-1, 1}) sum += grey.at(400 + int(sign * radius * 20 * 0.8), 320 + int(sign * radius * 20 * 0.6))[1];
    return sum / 2;
  };
  EXPECT_LT(light(13) + 30, light(11));
  EXPECT_LT(light(11) + 30, light(9));
  EXPECT_NEAR(light(11), 128, 45);  // lines of the mesh, and light, change it a little
}

// What lies beyond a span has the colours of its ends.
TEST(Pictures, ByValueShowASpanOfTheValues) {
  const std::string view = "--clip 16 16 16 0 0 1 --color-by value --palette grey ";
  const auto bright = [](const Image& image) {
    int count = 0;
    for (int y = 300; y < 660; ++y)
      for (int x = 400; x < 880; ++x) count += image.at(x, y)[0] > 150 ? 1 : 0;
    return count;
  };
  const int low = bright(drawn(ball(), view + "--color-span 0 100")), all = bright(drawn(ball(), view)),
            high = bright(drawn(ball(), view + "--color-span 250 300"));
  EXPECT_GT(low, all + 1000);
  EXPECT_GT(all, high + 1000);
}

TEST(Pictures, FetchDrawsWhatExtractDraws) {
  ServerProgram server;
  const TempDir folder;
  for (const std::string& options :
       {std::string("--error-percent 20"), std::string(), std::string("--color-by value --palette cividis --clip 0 0 0 0 0 1"),
        std::string("--render volume --opacity 120:0,150:0.1,190:0.6 --palette ice --eye 1.2 0.1 -2.5 --look-at 0 0 0 --viewport 320 240"),
        std::string("--eye 1.2 0.1 -2.5 --look-at 0 0 0 --viewport 640 480 --pixel-error 2 --clip 0 0 0 0 0 -1 --edges")}) {
    SCOPED_TRACE(options);
    const Image expected = drawn(buckyball(), options);
    std::vector<std::string> fetch{program("intervale-client"), "fetch", server.url("buckyball"), "--image", folder / "fetch.png"};
    std::istringstream words(options);
    for (std::string word; words >> word;) fetch.push_back(word);
    const Finished fetched = run(fetch);
    ASSERT_EQ(fetched.status, 0) << fetched.err;
    const Image got = read_png(folder / "fetch.png");
    ASSERT_EQ(got.rgb.size(), expected.rgb.size());
    EXPECT_LT(share(got, Hue::background), 0.98);
    std::size_t differ = 0;
    for (std::size_t i = 0; i < got.rgb.size(); ++i) differ += got.rgb[i] != expected.rgb[i] ? 1 : 0;
    EXPECT_EQ(differ, 0u);
  }
}

// Those of a volume refine the inside, too, where there is a choice.
TEST(Pictures, OfVolumesAreRefinedUniformly) {
  const TempDir folder;
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "33", "-o", folder / "x.nrrd"}).status, 0);
  const Finished built = run({program("intervale"), "build", folder / "x.nrrd", "-o", folder / "every.ivm"});
  ASSERT_EQ(built.status, 0) << built.err;
  const std::string options =
      "--range 60 188 --error-percent 10 --render volume --color-span 50 200 --eye 1.2 0.1 -2.5 --look-at 0 0 0 --viewport 320 240";
  const Image image = drawn(folder / "every.ivm", options);
  EXPECT_EQ(image.rgb, drawn(folder / "every.ivm", options + " --refine uniform").rgb);
  EXPECT_NE(image.rgb, drawn(folder / "every.ivm", options + " --refine boundary").rgb);
  EXPECT_GT(column_of_bar(image, {253, 231, 37}, {68, 1, 84}), 240);
  ServerProgram server(folder / "every.ivm");
  std::vector<std::string> fetch{program("intervale-client"), "fetch", server.url("every"), "--image", folder / "fetch.png"};
  std::istringstream words(options);
  for (std::string word; words >> word;) fetch.push_back(word);
  const Finished fetched = run(fetch);
  ASSERT_EQ(fetched.status, 0) << fetched.err;
  EXPECT_EQ(read_png(folder / "fetch.png").rgb, image.rgb);
}

// Opaque, the ball is as large as its surface; its lightest values are inside.
TEST(Pictures, OfVolumesShowWhatIsInside) {
  const std::string camera = "--eye 16 16 916 --look-at 16 16 16 --fov 2.037 --viewport 200 160 --pixel-error 0.1 ",
                    view = camera + "--palette grey --render volume ";
  const Image dense = drawn(ball(), view + "--opacity 143:1"), thin = drawn(ball(), view + "--opacity 180:0,190:0.2"),
              surface = drawn(ball(), camera);
  for (const Image* image : {&dense, &thin}) {
    EXPECT_EQ(hue(image->at(100 + 75, 150)), Hue::background);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(image->at(5, 7)[k], surface.at(5, 7)[k], 1);
  }
  EXPECT_LT(dense.at(100, 80)[0], 40);
  EXPECT_LT(dense.at(100 - 65, 80)[0], 60);
  EXPECT_GT(thin.at(100, 80)[0], 200);  // nothing but light values, near beta
}

TEST(Pictures, GoWithAMeshFileAndWithFigures) {
  const TempDir folder;
  const Finished done = extract(ball(), "--json", {"--image", folder / "x.png", "-o", folder / "x.ply"});
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_THAT(done.out, StartsWith("{"));
  EXPECT_THAT(contents_of(folder / "x.ply"), StartsWith("ply"));
  EXPECT_EQ(read_png(folder / "x.png").width, 1280);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);  // nothing is left beside them
}

TEST(Pictures, OfNothingAreBackground) {
  const TempDir folder;
  const auto raw = folder.file("zeros.raw", std::string(27, '\0'));
  const Finished built =
      run({program("intervale"), "build", raw, "--dims", "3", "3", "3", "--type", "u8", "--range", "5", "9", "-o", folder / "empty.ivm"});
  ASSERT_EQ(built.status, 0) << built.err;
  const Image image = drawn(folder / "empty.ivm", "--clip 0 0 0 1 0 0 --edges");
  EXPECT_EQ(share(image, Hue::background), 1);
}

TEST(Pictures, ACameraThatSeesNothingIsToldAbout) {
  const TempDir folder;
  const std::string there = "--eye 16 16 99 --look-at 16 16 16 --viewport 64 64", away = "--eye 16 16 99 --look-at 16 16 999 --viewport 64 64";
  const Finished seen = extract(ball(), there, {"--image", folder / "x.png"}), unseen = extract(ball(), away, {"--image", folder / "y.png"});
  EXPECT_EQ(seen.status, 0) << seen.err;
  EXPECT_EQ(seen.err, "");
  EXPECT_EQ(unseen.status, 0) << unseen.err;
  EXPECT_EQ(unseen.err, "intervale: warning: nothing of the mesh is in the picture\n");
}

TEST(Pictures, WhatCannotBeDrawnIsOneLine) {
  const TempDir folder;
  const auto complaint = [&](const std::string& options, const std::string& name, int status, const std::string& about) {
    const Finished done = extract(ball(), options, {"--image", folder / name});
    EXPECT_EQ(done.status, status) << done.err;
    EXPECT_THAT(done.err, HasSubstr(about));
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_EQ(done.out, "");
  };
  complaint("--clip 0 0 0 0 0 0", "x.png", 2, "normal");
  complaint("--clip 0 0 0 nan 0 1", "x.png", 2, "finite");
  complaint("--clip 0 0 0 1", "x.png", 2, "--clip");
  complaint("", "x.jpg", 2, ".png");
  complaint("", "none/x.png", 1, "does not exist");
  complaint("--eye 0 0 99 --look-at 0 0 0 --viewport 65535 65535", "x.png", 2, "smaller viewport");
  complaint("--eye 0 0 99 --look-at 0 0 0 --viewport 65535 64", "x.png", 2, "each way");
  complaint("--color-by density", "x.png", 2, "no channel 'density'");
  complaint("--color-by value --palette jet", "x.png", 2, "viridis, cividis, inferno, ice or grey");
  complaint("--palette ice", "x.png", 2, "--color-by value");
  complaint("--render cloud", "x.png", 2, "surface,volume");
  complaint("--opacity 1:1", "x.png", 2, "--opacity needs --render volume");
  complaint("--render volume --opacity 1:1,0:1", "x.png", 2, "--opacity: values must ascend");
  complaint("--render volume --opacity 1", "x.png", 2, "VALUE:OPACITY");
  complaint("--render volume --edges", "x.png", 2, "--edges");
  complaint("--render volume --color-by surface", "x.png", 2, "--color-by surface");
  complaint("--color-span 1 2", "x.png", 2, "--color-by value");
  complaint("--color-by value --color-span 2 1", "x.png", 2, "--color-span");
  complaint("--color-by value --color-span 0 nan", "x.png", 2, "--color-span");
  complaint("--color-by value --color-span 0", "x.png", 2, "--color-span");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  const Finished without = extract(ball(), "--clip 0 0 0 0 0 1", {});
  EXPECT_EQ(without.status, 2);
  EXPECT_THAT(without.err, HasSubstr("--image"));
}

// Products of lengths exceed what doubles hold.
TEST(Pictures, OfVolumesOfExtremeSizeAreRefused) {
  const TempDir folder;
  const std::string raw = folder.file("cube.raw", std::string("\x00\x00\x00\x00\x00\x00\x00\xff", 8));
  const auto draw = [&](const std::string& spacing, const std::string& render) {
    const std::string file = folder / "cube.ivm";
    const Finished built = run({program("intervale"), "build", raw, "--dims", "2", "2", "2", "--type", "u8", "--spacing", spacing, spacing, spacing,
                                "--range", "100", "255", "-o", file});
    EXPECT_EQ(built.status, 0) << built.err;
    return extract(file, "--render " + render, {"--image", folder / "x.png"});
  };
  for (const char* const render : {"surface", "volume"}) {
    for (const char* const spacing : {"1e-300", "1e300"}) {
      const Finished done = draw(spacing, render);
      EXPECT_EQ(done.status, 1) << done.err;
      EXPECT_THAT(done.err, StartsWith("intervale: cannot draw '"));
      EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
      EXPECT_FALSE(std::filesystem::exists(folder / "x.png"));
    }
    for (const char* const spacing : {"1e-70", "1e70"}) {
      EXPECT_EQ(draw(spacing, render).status, 0);
      EXPECT_LT(share(read_png(folder / "x.png"), Hue::background), 0.99);
      std::filesystem::remove(folder / "x.png");
    }
  }
}

TEST(Pictures, AMachineWithoutEglIsOneLine) {
  const TempDir folder;
  const Finished done = run(
      {"/usr/bin/env", "__EGL_VENDOR_LIBRARY_DIRS=" + folder.path().string(), program("intervale"), "extract", ball(), "--image", folder / "x.png"});
  EXPECT_EQ(done.status, 1);
  EXPECT_THAT(done.err, StartsWith("intervale: cannot draw a picture: "));
  EXPECT_THAT(done.err, HasSubstr("libegl1"));
  EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace intervale
