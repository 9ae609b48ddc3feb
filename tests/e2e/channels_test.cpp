// Channels, as users of the programs have them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
constexpr int kSide = 20;

// `components` floats at each sample of a cube: 0, 1, ... times its x. header: more lines. hole: the first float is NaN.
std::string nrrd(int side, int components, const std::string& header = {}, bool hole = false) {
  std::string text = "NRRD0004\ntype: float\nencoding: raw\nendian: little\n" + header;
  const std::string sizes = std::to_string(side) + " " + std::to_string(side) + " " + std::to_string(side) + "\n";
  text += components == 1 ? "dimension: 3\nsizes: " + sizes : "dimension: 4\nkinds: vector domain domain domain\nsizes: 3 " + sizes;
  text += "\n";
  for (int i = 0; i < side * side * side; ++i) {
    for (int c = 0; c < components; ++c) {
      const float value = hole && i == 0 && c == 0 ? std::numeric_limits<float>::quiet_NaN() : float(c + 1) * float(i % side);
      char bytes[sizeof value];
      std::memcpy(bytes, &value, sizeof value);
      text.append(bytes, sizeof value);
    }
  }
  return text;
}

std::string text_of(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

class Channels : public ::testing::Test {
 public:
  Channels() {
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", std::to_string(kSide), "-o", field}).status, 0);
    folder.file("heat.nrrd", nrrd(kSide, 1, "sample units: \"K\"\n"));
    folder.file("wind.nrrd", nrrd(kSide, 3));
    EXPECT_EQ(build(every, both).status, 0);
    EXPECT_EQ(build(one, both + Arguments{"--range", "-0.5", "0.25"}).status, 0);
  }
  [[nodiscard]] Finished build(const std::string& to, const Arguments& options) const {
    return run(Arguments{program("intervale"), "build", field, "-o", to} + options);
  }

  [[nodiscard]] std::string path(const std::string& name) const { return (folder / name).string(); }

  const TempDir folder;
  const std::string field = folder / "gyroid.nrrd", every = folder / "every.ivm", one = folder / "one.ivm";
  const Arguments both{"--channel", "heat=" + path("heat.nrrd"), "--channel", "wind=" + path("wind.nrrd"), "--channel-step", "heat=0.5"};
};

TEST_F(Channels, InfoNamesThem) {
  for (const std::string& file : {every, one}) {
    const auto channels = json_of(run({program("intervale"), "info", file, "--json"})).at("channels");
    ASSERT_EQ(channels.size(), 2u);
    EXPECT_EQ(
        channels[0],
        (nlohmann::json{{"name", "heat"}, {"kind", "scalar"}, {"unit", "K"}, {"values", {{"least", 0.0}, {"greatest", 19.0}}}, {"steps", {0.0}}}));
    EXPECT_EQ(channels[1].at("kind"), "vector");
    EXPECT_EQ(channels[1].at("values").at("least"), 0);
    EXPECT_NEAR(channels[1].at("values").at("greatest").get<double>(), 19 * std::sqrt(14.0), 1e-9);
    EXPECT_EQ(channels[1].at("steps"), nlohmann::json({0.0, 0.0, 0.0}));
    EXPECT_THAT(run({program("intervale"), "info", file}).out, HasSubstr("channel heat: scalar, in K, 0 to 19\n"));
    EXPECT_EQ(run({program("intervale"), "verify", file}).status, 0);
  }
}

TEST_F(Channels, AClientReceivesTheArraysThatExtractWrites) {
  const ServerProgram server(folder.path().string());
  const Arguments range{"--range", "-0.5", "0.25"};
  for (const Arguments& level : std::vector<Arguments>{{}, {"--error-percent", "10"}, {"--range", "0.5", "1"}, {"--max-updates", "300"}}) {
    for (const Arguments& names : std::vector<Arguments>{{"--channel", "wind"}, {"--channel", "wind", "--channel", "heat"}}) {
      const Arguments options = range + level + names;
      ASSERT_EQ(run(Arguments{program("intervale"), "extract", every, "-o", folder / "a.vtu"} + options).status, 0);
      ASSERT_EQ(run(Arguments{client(), "fetch", server.url("every"), "-o", folder / "b.vtu"} + options).status, 0);
      const std::string mesh = text_of(folder / "a.vtu");
      EXPECT_THAT(mesh, HasSubstr("Name=\"wind\" NumberOfComponents=\"3\""));
      EXPECT_EQ(mesh.find("Name=\"heat\"") != std::string::npos, names.size() > 2);
      EXPECT_THAT(text_of(folder / "b.vtu"), HasSubstr("Name=\"wind\""));
    }
  }
  ASSERT_EQ(run({client(), "fetch", server.url("one"), "-o", folder / "c.vtp", "--channel", "heat"}).status, 0);
  EXPECT_THAT(text_of(folder / "c.vtp"), HasSubstr("Name=\"heat\" NumberOfComponents=\"1\""));
}

TEST_F(Channels, WithoutThemTheStreamIsAsItWas) {
  EXPECT_EQ(build(folder / "none.ivm", {}).status, 0);
  const ServerProgram server(folder.path().string());
  const Arguments range{"--range", "-0.5", "0.25", "--digest"};
  const auto with = fetch_json(range, server.url("every")), without = fetch_json(range, server.url("none"));
  for (const char* key : {"updates", "tets", "digest", "messages"}) EXPECT_EQ(with.at(key), without.at(key)) << key;
  EXPECT_GT(fetch_json(range + Arguments{"--channel", "wind"}, server.url("every")).at("bytes_received"), with.at("bytes_received"));
}

TEST_F(Channels, APictureHasTheirColours) {
  const ServerProgram server(folder.path().string());
  const Arguments look{"--range", "-0.5", "0.25", "--image", folder / "a.png", "--color-by"};
  const auto info = json_of(run({program("intervale"), "info", every, "--json"}));
  for (const auto& channel : info.at("channels")) {
    const auto name = channel.at("name").get<std::string>();
    EXPECT_EQ(run(Arguments{program("intervale"), "extract", every} + look + Arguments{name}).status, 0);
    const std::string extracted = text_of(folder / "a.png");
    EXPECT_EQ(run(Arguments{client(), "fetch", server.url("every")} + look + Arguments{name}).status, 0);
    EXPECT_EQ(text_of(folder / "a.png"), extracted);
    const Arguments span{"--color-span", channel.at("values").at("least").dump(), channel.at("values").at("greatest").dump()};
    EXPECT_EQ(run(Arguments{program("intervale"), "extract", every} + look + Arguments{name} + span).status, 0);
    EXPECT_EQ(text_of(folder / "a.png"), extracted);
  }
}

TEST_F(Channels, SamplesThatAreNoNumbersAreRefusedOrReplaced) {
  for (const int components : {1, 3}) {
    folder.file("hole.nrrd", nrrd(kSide, components, {}, true));
    const Arguments hole{"--channel", "hole=" + path("hole.nrrd")};
    expect_complaint(build(folder / "x.ivm", hole), 1, "--nan VALUE", "intervale: ");
    EXPECT_EQ(build(folder / "x.ivm", hole + Arguments{"--nan", "7"}).status, 0);
  }
}

TEST_F(Channels, WrongUsageIsSaid) {
  folder.file("small.nrrd", nrrd(kSide - 1, 1));
  const auto complaint = [&](const Arguments& options, int status, const char* part) {
    expect_complaint(build(folder / "x.ivm", options), status, part, "intervale: ");
  };
  complaint({"--channel", "heat"}, 2, "is not NAME=");
  complaint({"--channel", "=" + path("heat.nrrd")}, 2, "is not NAME=");
  complaint({"--channel", "value=" + path("heat.nrrd")}, 2, "other than surface, value and range");
  complaint(both + both, 2, "two channels are named 'heat'");
  complaint({"--channel", "heat=" + path("none.nrrd")}, 1, "none.nrrd");
  complaint({"--channel", "heat=" + path("small.nrrd")}, 1, "19 x 19 x 19 samples, the field has 20 x 20 x 20");
  complaint({"--channel-step", "heat=1"}, 2, "no channel is named 'heat'");
  complaint(both + Arguments{"--channel-step", "wind=fast"}, 2, "'fast' is not a number");
  complaint(both + Arguments{"--channel-step", "wind=-1"}, 2, "channel 'wind'");
  expect_complaint(run({program("intervale"), "build", folder / "wind.nrrd", "-o", folder / "x.ivm"}), 2, "choose a component with --part 0, 1 or 2",
                   "intervale: ");
  const ServerProgram server(folder.path().string());
  expect_complaint(run({program("intervale"), "extract", one, "--channel", "rain"}), 2, "no channel 'rain'; it has heat, wind", "intervale: ");
  expect_complaint(run({client(), "fetch", server.url("one"), "--channel", "rain"}), 2, "no channel 'rain'; it has heat, wind", "intervale-client: ");
}

}  // namespace
}  // namespace intervale
