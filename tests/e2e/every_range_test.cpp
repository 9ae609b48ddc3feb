// Data sets of every range, as users of the programs have them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/raw_client.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

class EveryRange : public ::testing::Test {
 public:
  EveryRange() {
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "20", "-o", volume}).status, 0);
    built = json_of(run({program("intervale"), "build", volume, "-o", every, "--step", "0.001", "--json"}));
  }
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd", every = folder / "every.ivm", one = folder / "one.ivm";
  nlohmann::json built;
};

TEST_F(EveryRange, InfoSaysWhatIsInIt) {
  const auto info = json_of(run({program("intervale"), "info", every, "--json"}));
  EXPECT_EQ(info.at("scope"), "every");
  EXPECT_EQ(info.at("dims"), nlohmann::json({20, 20, 20}));
  EXPECT_EQ(info.at("step"), 0.001);
  EXPECT_EQ(info.at("file_bytes"), std::filesystem::file_size(every));
  EXPECT_FALSE(info.contains("range") || info.contains("full"));
  for (const char* key : {"values", "max_error", "updates", "supercubes", "memory_bytes", "histogram"}) EXPECT_EQ(info.at(key), built.at(key)) << key;
  std::uint64_t samples = 0;
  for (const auto& bin : info.at("histogram")) samples += bin.get<std::uint64_t>();
  EXPECT_EQ(samples, 8000u);
  EXPECT_THAT(run({program("intervale"), "info", every}).out, HasSubstr("off by 0.0005 at most"));
  EXPECT_EQ(run({program("intervale"), "verify", every}).status, 0);
}

TEST_F(EveryRange, InfoSaysHowMuchARangeEncloses) {
  constexpr double kBox = 8;  // from -1 to 1 on each axis
  for (const auto& [low, high] : {std::pair{"-0.5", "0.75"}, std::pair{"0.1", "inf"}, std::pair{"0.2", "0.2"}, std::pair{"7", "8"}}) {
    const auto mesh = json_of(run({program("intervale"), "extract", every, "--range", low, high, "--json"}));
    const auto info = json_of(run({program("intervale"), "info", every, "--range", low, high, "--json"}));
    EXPECT_NEAR(info.at("enclosed_volume").get<double>(), mesh.at("volume").get<double>(), 0.001 * kBox) << low;
    EXPECT_NEAR(info.at("enclosed_share").get<double>() * kBox, info.at("enclosed_volume").get<double>(), 1e-12);
  }
  EXPECT_THAT(run({program("intervale"), "info", every, "--range", "-inf", "5"}).out, HasSubstr("range [-inf, 5]: volume 8, 100 % of the box"));
  EXPECT_FALSE(json_of(run({program("intervale"), "info", every, "--json"})).contains("enclosed_volume"));
  // A data set of one range has its own, or all within it.
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", one, "--range", "-0.5", "0.75", "--step", "0.001"}).status, 0);
  const auto own = json_of(run({program("intervale"), "info", one, "--range", "-0.5", "0.75", "--json"}));
  EXPECT_EQ(own.at("enclosed_volume").get<double>(), json_of(run({program("intervale"), "extract", one, "--json"})).at("volume").get<double>());
  expect_complaint(run({program("intervale"), "info", one, "--range", "0", "0.5"}), 2, "built for the range [-0.5, 0.75] alone", "intervale: ");
  expect_complaint(run({program("intervale"), "info", every, "--range", "2", "1"}), 2, "greater than HI", "intervale: ");
}

TEST_F(EveryRange, AnyRangeGivesTheMeshOfADataSetOfThatRange) {
  // Whole numbers, so that both have the same values.
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "20", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", every, "--step", "0"}).status, 0);
  for (const auto& [low, high] : {std::pair{"20", "60"}, std::pair{"-inf", "40"}, std::pair{"100", "100"}, std::pair{"900", "inf"}}) {
    ASSERT_EQ(run({program("intervale"), "build", volume, "-o", one, "--range", low, high, "--step", "0"}).status, 0);
    const auto expected = json_of(run({program("intervale"), "extract", one, "--json", "--digest"}));
    const auto got = json_of(run({program("intervale"), "extract", every, "--range", low, high, "--json", "--digest"}));
    for (const char* key : {"updates", "vertices", "tets", "digest"}) EXPECT_EQ(got.at(key), expected.at(key)) << low << " " << key;
  }
}

TEST_F(EveryRange, ADataSetThatIsRefinedUniformlyHasEveryRangeWithinItsOwn) {
  const std::string sheet = one + ".sheet.ivm";
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", one, "--range", "0", "60", "--refine", "uniform"}).status, 0);
  for (const auto& [low, high] : {std::pair{"20", "40"}, std::pair{"0", "10"}, std::pair{"33", "33"}}) {
    ASSERT_EQ(run({program("intervale"), "build", volume, "-o", sheet, "--range", low, high}).status, 0);
    const auto expected = json_of(run({program("intervale"), "extract", sheet, "--json", "--digest"}));
    const auto got = json_of(run({program("intervale"), "extract", one, "--range", low, high, "--json", "--digest"}));
    for (const char* key : {"updates", "vertices", "tets", "digest"}) EXPECT_EQ(got.at(key), expected.at(key)) << low << " " << key;
  }
  expect_complaint(run({program("intervale"), "extract", one, "--range", "20", "61"}), 2, "within [0, 60]", "intervale: ");
}

// Cameras and budgets, too.
TEST_F(EveryRange, AClientReceivesTheMeshThatExtractMakes) {
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", one, "--range", "-0.5", "1", "--refine", "uniform"}).status, 0);
  const ServerProgram server(folder.path().string());
  const std::string url = server.url();
  const std::vector<std::vector<std::string>> levels{{},
                                                     {"--error-percent", "10"},
                                                     {"--refine", "uniform", "--error-percent", "20"},
                                                     {"--eye", "3", "2", "1", "--look-at", "0", "0", "0", "--pixel-error", "8"},
                                                     {"--max-updates", "500"}};
  for (const std::string& file : {every, one}) {
    const std::string name = std::filesystem::path(file).stem();
    for (const auto& [low, high] : {std::pair{"-0.5", "0.25"}, std::pair{"0", "0"}, std::pair{"-0.2", "1"}}) {
      for (std::vector<std::string> options : levels) {
        options.insert(options.end(), {"--range", low, high, "--digest"});
        std::vector<std::string> extract{program("intervale"), "extract", file, "--json"};
        extract.insert(extract.end(), options.begin(), options.end());
        const auto expected = json_of(run(extract)), got = fetch_json(options, server.url(name));
        for (const char* key : {"updates", "vertices", "tets", "digest"})
          EXPECT_EQ(got.at(key), expected.at(key)) << name << " " << low << " " << key;
      }
    }
  }
  const auto list = json_of(run({client(), "list", url, "--json"})).at("datasets");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list.at(0).at("scope"), "every");
  EXPECT_FALSE(list.at(0).contains("range") || list.at(0).contains("full"));
  EXPECT_THAT(run({client(), "list", url}).out, HasSubstr("every: 20 x 20 x 20 samples, every range, values -1.495 to 1.495"));
  expect_complaint(run({client(), "fetch", server.url("every")}), 2, "--range LO HI");
  expect_complaint(run({client(), "fetch", server.url("one"), "--range", "0", "1.5"}), 2, "within [-0.5, 1]");
  expect_complaint(run({client(), "fetch", server.url("every"), "--range", "1", "0"}), 2, "is greater than HI");
  const std::string load = program("intervale-load");
  EXPECT_EQ(run({load, server.url("every"), "--range", "0", "1", "--clients", "3", "--duration", "0.5", "--verify"}).status, 0);
  expect_complaint(run({load, server.url("every"), "--clients", "1", "--duration", "0.1"}), 2, "--range LO HI", "intervale-load: ");
  expect_complaint(run({load, server.url("one"), "--range", "0", "9", "--clients", "1", "--duration", "0.1"}), 2, "within [-0.5, 1]",
                   "intervale-load: ");
}

Lod lod_of(double error_percent) {
  Lod lod;
  lod.error_percent = error_percent;
  return lod;
}

TEST_F(EveryRange, ADragFindsWhatFollowedDone) {
  const ServerProgram server(every);
  const protocol::Open open{"every", "test", protocol::kDefaultWindow};
  constexpr double kPercent = 10, kInfinity = std::numeric_limits<double>::infinity();
  RawClient whole(server.port());
  whole.send(open);
  whole.send(protocol::View{.epoch = 1, .lod = lod_of(kPercent), .shown = {{{-kInfinity, kInfinity}}, Refine::uniform}});
  const std::uint64_t all = whole.stream_to_end();
  EXPECT_GT(all, 100u);

  RawClient client(server.port());
  client.send(open);
  client.send(protocol::View{.epoch = 1, .lod = lod_of(50), .shown = {{{-0.5, 0.25}}, {}}, .coarse_error_percent = kPercent});
  client.expect<protocol::Opened>();
  std::uint64_t updates = 0, until_done = 0;
  bool is_done = false;
  while (!is_done || updates < all) {
    const auto message = client.receive();
    ASSERT_TRUE(message);
    if (const auto* done = std::get_if<protocol::Done>(&*message)) {
      is_done = true;
      until_done = updates;
      EXPECT_EQ(done->updates_sent, updates);
    } else {
      updates += std::get<protocol::Batch>(*message).updates;
    }
  }
  EXPECT_LT(until_done, all);
  EXPECT_EQ(updates, all);
  client.send(protocol::View{.epoch = 2, .lod = lod_of(kPercent), .shown = {{{0.1, 0.7}}, {}}});
  EXPECT_EQ(client.expect<protocol::Done>().updates_sent, all) << "no batch before it";
  client.send(protocol::View{.epoch = 3, .lod = {}, .shown = {{{0.1, 0.7}}, {}}, .coarse_error_percent = std::nan("")});
  EXPECT_EQ(client.end().code, static_cast<unsigned>(protocol::CloseCode::malformed));
}

TEST_F(EveryRange, TheCoarsestOfEveryRangeGoAheadOfTheRestOfAView) {
  const ServerProgram server(every);
  Lod lod;
  lod.camera = Camera{.eye = {60, -50, 40}, .look_at = {16, 16, 16}, .up = {0, 0, 1}, .fov = 45, .viewport = {1920, 1080}, .pixel_error = 0.25};
  const auto updates = [&](std::optional<double> percent) {
    RawClient client(server.port());
    client.send(protocol::Open{"every", "test", protocol::kDefaultWindow});
    client.send(protocol::View{.epoch = 1, .lod = lod, .shown = {{{-0.5, 0.25}}, {}}, .coarse_error_percent = percent});
    return client.stream_to_end();
  };
  EXPECT_GT(updates(10), updates({}));
  EXPECT_EQ(updates(100), updates({})) << "no error is above";
}

TEST_F(EveryRange, WrongUsageIsSaid) {
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", one, "--range", "0", "1"}).status, 0);
  const auto complains = [](const std::vector<std::string>& arguments, const std::string& about, int status = 2) {
    std::vector<std::string> all{program("intervale")};
    all.insert(all.end(), arguments.begin(), arguments.end());
    expect_complaint(run(all), status, about, "intervale: ");
  };
  complains({"extract", every}, "--range LO HI");
  complains({"extract", every, "--range", "1", "0"}, "is greater than HI");
  complains({"extract", one, "--range", "0", "0.5"}, "was built for the range [0, 1] alone");
  complains({"extract", one, "--refine", "uniform"}, "--refine");
  complains({"build", volume, "-o", every, "--refine", "uniform"}, "--refine");
  for (const char* step : {"-1", "nan", "1e-300"}) complains({"build", volume, "-o", every, "--step", step}, "step");
}

}  // namespace
}  // namespace intervale
