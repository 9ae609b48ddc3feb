// Builds within a budget of memory: the same file, byte for byte, and nothing left behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kIsResidentKnown = false;  // sanitizers have memory of their own
const std::string kSize = "49";
#else
constexpr bool kIsResidentKnown = true;
const std::string kSize = "225";
#endif
constexpr std::uint64_t kBudget = 128 << 20;

struct ScratchBuild : ::testing::Test {
  TempDir folder;
  std::string volume = folder / "volume.nrrd", plain = folder / "plain.ivm", small = folder / "small.ivm";

  void SetUp() override { ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", kSize, "--type", "u16", "-o", volume}).status, 0); }

  static std::vector<std::string> build(const std::string& from, const std::string& to, const std::vector<std::string>& more) {
    std::vector<std::string> words{program("intervale"), "build", from, "-o", to, "--threads", "2"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  void expect_same_file(const std::vector<std::string>& options) {
    ASSERT_EQ(run(build(volume, plain, options)).status, 0);
    auto limited = options;
    limited.insert(limited.end(), {"--memory", std::to_string(kBudget), "--scratch", folder.path(), "--json"});
    const auto made = run(build(volume, small, limited));
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_TRUE(contents_of(plain) == contents_of(small));
    const auto stats = nlohmann::json::parse(made.out);
    EXPECT_GT(stats["scratch_bytes"].get<std::uint64_t>(), std::filesystem::file_size(volume) / 2);
    if (kIsResidentKnown) {
      EXPECT_LE(stats["resident_bytes"].get<std::uint64_t>(), kBudget);
    }
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3) << "the volume and two data sets";
  }
};

TEST_F(ScratchBuild, OfEveryRangeIsTheSameFile) { expect_same_file({}); }
TEST_F(ScratchBuild, OfOneRangeIsTheSameFile) { expect_same_file({"--range", "20000", "30000"}); }
TEST_F(ScratchBuild, WithAChannelIsTheSameFile) { expect_same_file({"--channel", "again=" + volume}); }

TEST_F(ScratchBuild, OptionsThatCannotBeAreOneLine) {
  const auto alone = run(build(volume, small, {"--scratch", folder.path()}));
  EXPECT_EQ(alone.status, 2);
  EXPECT_EQ(alone.err, "intervale: --scratch belongs to a limit of memory, or to --resume: give --memory or --resume too\n");
  const auto little = run(build(volume, small, {"--memory", "1MB"}));
  EXPECT_EQ(little.status, 2);
  EXPECT_THAT(little.err, StartsWith("intervale: a budget of 1 MB is too small: with 2 threads at least "));
  const auto nowhere = run(build(volume, small, {"--memory", "1GB", "--scratch", folder / "none"}));
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("No such file or directory"));
  EXPECT_FALSE(std::filesystem::exists(small));
}

TEST_F(ScratchBuild, AFullScratchDiskIsOneLineAndLeavesNothing) {
  const std::string script = "mount -t tmpfs -o size=64k none \"$1\" || exit 77; \"$2\" build \"$3\" -o \"$4\" --memory 256MiB --scratch \"$1\"";
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  const auto full =
      run({"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", disk, program("intervale"), volume, small});
  if (full.status != 1) GTEST_SKIP() << "no small disk can be had here: " << full.err;
  EXPECT_THAT(full.err, ::testing::AllOf(StartsWith("intervale: the scratch folder '"), HasSubstr("No space left on device")));
  EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
  EXPECT_FALSE(std::filesystem::exists(small));
}

}  // namespace
}  // namespace intervale
