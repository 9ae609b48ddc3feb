// Several ranges at once, as users of the programs have them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

const Arguments kRanges{"--range", "-0.5", "0.25", "--range", "0.1", "1", "--range", "0.9", "0.9"};

class SeveralRanges : public ::testing::Test {
 public:
  SeveralRanges() {
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "20", "-o", folder / "gyroid.nrrd"}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", folder / "gyroid.nrrd", "-o", every, "--step", "0.001"}).status, 0);
  }
  [[nodiscard]] nlohmann::json extract(const Arguments& options) const {
    return json_of(run(Arguments{program("intervale"), "extract", every, "--json", "--digest"} + options));
  }
  const TempDir folder;
  const std::string every = folder / "every.ivm";
};

TEST_F(SeveralRanges, EachHasTheMeshThatItHasAlone) {
  for (const Arguments& options : {Arguments{}, {"--error-percent", "10"}, {"--refine", "uniform", "--error-percent", "20"}}) {
    const auto all = extract(options + kRanges);
    ASSERT_EQ(all.at("ranges").size(), 3u);
    nlohmann::json sums{{"updates", 0}, {"vertices", 0}, {"tets", 0}};
    double volume = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& one = all.at("ranges").at(i);
      const auto alone = extract(options + Arguments(kRanges.begin() + std::ptrdiff_t(3 * i), kRanges.begin() + std::ptrdiff_t(3 * i + 3)));
      EXPECT_FALSE(alone.contains("ranges"));
      EXPECT_EQ(one.at("range"), nlohmann::json({std::stod(kRanges[3 * i + 1]), std::stod(kRanges[3 * i + 2])}));
      for (const char* key : {"updates", "vertices", "tets", "volume", "digest"}) EXPECT_EQ(one.at(key), alone.at(key)) << i << " " << key;
      for (auto& [key, sum] : sums.items()) sum = sum.get<std::uint64_t>() + alone.at(key).get<std::uint64_t>();
      volume += alone.at("volume").get<double>();
    }
    for (auto& [key, sum] : sums.items()) EXPECT_EQ(all.at(key), sum) << key;
    EXPECT_NEAR(all.at("volume").get<double>(), volume, 1e-12);
  }
}

TEST_F(SeveralRanges, AClientReceivesTheMeshesThatExtractMakes) {
  const ServerProgram server(folder.path().string());
  const std::vector<Arguments> levels{
      {}, {"--error-percent", "10"}, {"--eye", "3", "2", "1", "--look-at", "0", "0", "0", "--pixel-error", "8"}, {"--max-updates", "500"}};
  for (const Arguments& level : levels) {
    const auto expected = extract(level + kRanges), got = fetch_json(level + kRanges + Arguments{"--digest"}, server.url("every"));
    for (const char* key : {"updates", "vertices", "tets", "digest", "ranges"}) EXPECT_EQ(got.at(key), expected.at(key)) << key;
  }
  EXPECT_THAT(run(Arguments{client(), "fetch", server.url("every")} + kRanges).out, ::testing::HasSubstr("\n[0.1, 1]: "));
  const Arguments load{program("intervale-load"), server.url("every"), "--clients", "3", "--duration", "0.5", "--verify", "--max-tets", "5000"};
  EXPECT_EQ(run(load + kRanges).status, 0);
}

TEST_F(SeveralRanges, AFileSaysWhichRangeATetrahedronIsOf) {
  const std::string mesh = folder / "all.vtu";
  ASSERT_EQ(run(Arguments{program("intervale"), "extract", every, "-o", mesh, "--image", folder / "all.png"} + kRanges).status, 0);
  const auto text_of = [](const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  };
  EXPECT_THAT(text_of(mesh), ::testing::HasSubstr("<CellData Scalars=\"range\">\n<DataArray type=\"UInt8\" Name=\"range\""));
  ASSERT_EQ(run({program("intervale"), "extract", every, "-o", mesh, "--range", "0", "1"}).status, 0);
  EXPECT_THAT(text_of(mesh), ::testing::Not(::testing::HasSubstr("CellData")));
}

TEST_F(SeveralRanges, WrongUsageIsSaid) {
  const ServerProgram server(folder.path().string());
  const Arguments two{"--range", "0", "1", "--range", "0.5", "1"};
  const Arguments extract{program("intervale"), "extract", every}, fetch{client(), "fetch", server.url("every")};
  for (const auto& [command, name] : {std::pair{extract, "intervale: "}, std::pair{fetch, "intervale-client: "}}) {
    expect_complaint(run(command + two + two + Arguments{"--range", "0", "1"}), 2, "at most 4 ranges", name);
    expect_complaint(run(command + two + Arguments{"--range", "1", "0"}), 2, "is greater than HI", name);
    expect_complaint(run(command + two + Arguments{"--range", "nan", "0"}), 2, "'nan' is not a number", name);
  }
  ASSERT_EQ(run({program("intervale"), "build", folder / "gyroid.nrrd", "-o", folder / "one.ivm", "--range", "0", "1"}).status, 0);
  expect_complaint(run(Arguments{program("intervale"), "extract", folder / "one.ivm"} + two), 2, "was built for the range [0, 1] alone",
                   "intervale: ");
}

}  // namespace
}  // namespace intervale
