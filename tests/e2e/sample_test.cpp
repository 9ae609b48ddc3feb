// intervale sample, as its users have it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "server/volume/nrrd.h"
#include "server/volume/samples.h"
#include "tests/support/complaints.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

Finished sample(const std::vector<std::string>& options) {
  std::vector<std::string> arguments{program("intervale"), "sample"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return run(arguments);
}

// Of several slabs.
TEST(Sample, TheFileIsThatOfTheWholeVolume) {
  const TempDir folder;
  // The thread sanitizer does not know how oneTBB's threads hand over.
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  for (const auto name : sample_names()) {
    const auto finished = sample({std::string(name), "--size", "140", "-o", folder / "made.nrrd"});
    ASSERT_EQ(finished.status, 0) << finished.err;
    EXPECT_EQ(finished.err, "");
    ASSERT_TRUE(write_nrrd(folder / "whole.nrrd", make_sample(name, 140).value()));
    EXPECT_TRUE(contents_of(folder / "made.nrrd") == contents_of(folder / "whole.nrrd")) << name;
  }
}

TEST(Sample, EveryTypeIsReadAgain) {
  const TempDir folder;
  const std::string file = folder / "x.nrrd";
  for (int type = 0; type < kSampleTypes; ++type) {
    const std::string name = name_of(SampleType(type));
    const auto finished = sample({"gyroid", "--size", "9", "--type", name, "-o", file, "--json"});
    ASSERT_EQ(finished.status, 0) << finished.err;
    EXPECT_EQ(nlohmann::json::parse(finished.out),
              nlohmann::json({{"name", "gyroid"}, {"dims", {9, 9, 9}}, {"type", name}, {"file", file}, {"bytes", 729 * size_of(SampleType(type))}}));
    const auto volume = read_nrrd(file);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->type, SampleType(type));
    EXPECT_EQ(run({program("intervale"), "build", file, "-o", folder / "x.ivm"}).status, 0);
  }
}

TEST(Sample, WrongUsageIsStatus2) {
  const TempDir folder;
  const std::string file = folder / "x.nrrd";
  const auto refused = [](const Finished& finished, const std::string& about) { expect_complaint(finished, 2, about, "intervale: "); };
  refused(sample({"teapot", "-o", file}), "marschner-lobb");
  refused(sample({"gyroid", "-o", file, "--type", "u64"}), "unknown sample type 'u64'");
  refused(sample({"gyroid", "-o", file, "--size", "8193"}), "2 to 8192");
  refused(sample({"gyroid", "-o", file, "--size", "1"}), "2 to 8192");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Sample, AFileThatCannotBeWrittenIsOneLineAndNothingIsLeft) {
  const TempDir folder;
  const std::string file = folder / "x.nrrd";
  EXPECT_EQ(sample({"gyroid", "-o", "/dev/full"}).err, "intervale: cannot write '/dev/full': No space left on device\n");
  const auto limited = run({"/bin/sh", "-c", "ulimit -f 16; exec \"$@\"", "sh", program("intervale"), "sample", "gyroid", "-o", file});
  EXPECT_EQ(limited.status, 1);
  EXPECT_EQ(limited.err, "intervale: cannot write '" + file + "': File too large\n");
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  EXPECT_THAT(sample({"gyroid", "-o", folder / "no/x.nrrd"}).err, ::testing::HasSubstr("does not exist"));
}

// SIGINT is ignored by what a shell runs in the background, and so it may be here.
TEST(Sample, ASignalLeavesNothingBehind) {
  const TempDir folder;
  Process making({program("intervale"), "sample", "marschner-lobb", "--size", "8192", "-o", folder / "x.nrrd"});
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::filesystem::is_empty(folder.path()) && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  making.signal(SIGTERM);
  EXPECT_EQ(making.wait().status, 128 + SIGTERM);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace intervale
