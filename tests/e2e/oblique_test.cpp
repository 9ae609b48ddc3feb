// Grids that are turned, sheared or mirrored, and the names of what is measured, through the programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

// A ramp of 9 x 8 x 7 samples.
std::string samples() {
  std::string bytes;
  for (int z = 0; z < 7; ++z)
    for (int y = 0; y < 8; ++y)
      for (int x = 0; x < 9; ++x) bytes += char(10 * x + 5 * y + 3 * z);
  return bytes;
}

std::vector<std::string> build_raw(const std::string& input, const std::string& output, const std::vector<std::string>& more) {
  std::vector<std::string> command{
      program("intervale"), "build", input, "-o", output, "--dims", "9", "8", "7", "--type", "u8", "--range", "40", "90"};
  command.insert(command.end(), more.begin(), more.end());
  return command;
}

// Sheared and mirrored: its determinant is -6.
const std::vector<std::string> kAffine{"--affine", "-1", "0.5", "0", "100", "0", "2", "0.25", "-7", "0", "0", "3", "1e-3"};
constexpr std::array<double, 12> kRows{-1, 0.5, 0, 100, 0, 2, 0.25, -7, 0, 0, 3, 1e-3};

TEST(Oblique, AnAffineOfTheCommandLineGoesThroughEveryProgram) {
  const TempDir folder;
  const std::string raw = folder.file("v.raw", samples()), plain = folder / "plain.ivm", oblique = folder / "oblique.ivm";
  ASSERT_EQ(run(build_raw(raw, plain, {})).status, 0);
  auto options = kAffine;
  options.insert(options.end(), {"--unit", "mm", "--field", "density", "--field-unit", "HU", "--space", "RAS"});
  ASSERT_EQ(run(build_raw(raw, oblique, options)).status, 0);
  const auto info = json_of(run({program("intervale"), "info", oblique, "--json"}));
  EXPECT_EQ(info.at("affine"), nlohmann::json(kRows));
  EXPECT_EQ(info.at("origin"), nlohmann::json({100.0, -7.0, 1e-3}));
  EXPECT_EQ(info.at("spacing").at(0), 1.0);
  EXPECT_EQ(info.at("unit"), "mm");
  EXPECT_EQ(info.at("field"), "density");
  EXPECT_EQ(info.at("field_unit"), "HU");
  EXPECT_EQ(info.at("space"), "RAS");
  EXPECT_THAT(run({program("intervale"), "info", oblique}).out,
              ::testing::AllOf(HasSubstr("axes (-1, 0, 0), (0.5, 2, 0), (0, 0.25, 3), origin (100, -7, 0.001), in mm\n"), HasSubstr("space RAS\n"),
                               HasSubstr("field density, in HU\n")));
  EXPECT_THAT(run({program("intervale"), "info", plain}).out, HasSubstr("spacing (1, 1, 1), origin (0, 0, 0)\n"));

  const auto before = json_of(run({program("intervale"), "extract", plain, "--json"}));
  const auto after = json_of(run({program("intervale"), "extract", oblique, "--json", "--digest"}));
  EXPECT_EQ(after.at("tets"), before.at("tets"));
  EXPECT_NEAR(after.at("volume").get<double>(), 6 * before.at("volume").get<double>(), 1e-9 * after.at("volume").get<double>());
  const std::string every = folder / "every.ivm";
  std::vector<std::string> build{program("intervale"), "build", raw, "-o", every, "--dims", "9", "8", "7", "--type", "u8"};
  build.insert(build.end(), kAffine.begin(), kAffine.end());
  ASSERT_EQ(run(build).status, 0);
  constexpr double kBox = 6 * 8 * 7 * 6;  // of the samples; the box around them in the world is larger
  for (const std::string& file : {oblique, every}) {
    const auto enclosed = json_of(run({program("intervale"), "info", file, "--range", "40", "90", "--json"}));
    EXPECT_NEAR(enclosed.at("enclosed_volume").get<double>(), after.at("volume").get<double>(), 0.001 * kBox) << file;
    EXPECT_NEAR(enclosed.at("enclosed_share").get<double>() * kBox, enclosed.at("enclosed_volume").get<double>(), 1e-9) << file;
  }
  ServerProgram server(oblique);
  EXPECT_EQ(fetch_json({"--digest"}, server.url("oblique")).at("digest"), after.at("digest"));
  const auto listed = json_of(run({client(), "list", server.url(), "--json"})).at("datasets").at(0);
  for (const char* key : {"affine", "spacing", "origin", "unit", "field", "field_unit", "space"}) EXPECT_EQ(listed.at(key), info.at(key)) << key;
}

TEST(Oblique, DirectionsOfNrrdAreKeptAndOptionsOverrideItsLabels) {
  const TempDir folder;
  const std::string header =
      "NRRD0005\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 9 8 7\nspace directions: (-1,0,0) (0.5,2,0) (0,0.25,3)\n"
      "space origin: (100,-7,1e-3)\nspace units: \"mm\" \"mm\" \"mm\"\ncontent: head\nencoding: raw\n\n";
  const std::string nrrd = folder.file("v.nrrd", header + samples());
  const auto built = json_of(run({program("intervale"), "build", nrrd, "-o", folder / "v.ivm", "--field", "water", "--json"}));
  EXPECT_EQ(built.at("affine"), nlohmann::json(kRows));
  EXPECT_EQ(built.at("unit"), "mm");
  EXPECT_EQ(built.at("field"), "water");
  EXPECT_EQ(built.at("field_unit"), "");
  EXPECT_EQ(built.at("space"), "LPS");
}

TEST(Oblique, WhatCannotBeIsWrongUsageInOneLine) {
  const TempDir folder;
  const std::string raw = folder.file("v.raw", samples()), out = folder / "v.ivm";
  const auto refused = [&](const std::vector<std::string>& options, const std::string& part) {
    expect_complaint(run(build_raw(raw, out, options)), 2, part, "intervale: ");
  };
  auto both = kAffine;
  both.insert(both.end(), {"--spacing", "1", "1", "1"});
  refused(both, "--affine");
  refused({"--affine", "1", "2", "0", "0", "2", "4", "0", "0", "0", "0", "1", "0"}, "singular");
  refused({"--affine", "nan", "2", "0", "0", "2", "4", "0", "0", "0", "0", "1", "0"}, "finite");
  refused({"--affine", "1", "0", "0", "0", "0", "1e308", "1e308", "0", "0", "0", "1", "0"}, "far corner");
  refused({"--affine", "1", "2", "3"}, "--affine");
  refused({"--spacing", "1", "-1", "1"}, "--spacing");
  refused({"--unit", "a\nb"}, "--unit");
  refused({"--field", std::string(65, 'x')}, "--field");
  refused({"--field-unit", "\xff"}, "--field-unit");
}

}  // namespace
}  // namespace intervale
