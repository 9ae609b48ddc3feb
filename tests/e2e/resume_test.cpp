// Builds that are killed and go on: the same file, byte for byte, and nothing left behind.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <string>
#include <thread>

#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::StartsWith;
using Clock = std::chrono::steady_clock;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
const std::string kResumedSide = "41";
#else
const std::string kResumedSide = "81";
#endif
constexpr int kKills = 10;

struct ResumedBuild : ::testing::Test {
  TempDir folder;
  std::string volume = folder / "volume.nrrd", expected = folder / "expected.ivm", out = folder / "out.ivm", journal = folder / "out.ivm.resume";

  void SetUp() override {
    ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "--size", kResumedSide, "--type", "u16", "-o", volume}).status, 0);
  }

  [[nodiscard]] Arguments build(const std::string& to, const Arguments& more) const {
    return Arguments{program("intervale"), "build", volume, "-o", to, "--threads", "2", "--json"} + more;
  }
  [[nodiscard]] Arguments resumed(const Arguments& more) const { return build(out, more + Arguments{"--resume"}); }

  static nlohmann::json without_time(const std::string& text) {
    auto stats = nlohmann::json::parse(text);
    for (const char* const key : {"name", "seconds", "resident_bytes", "scratch_bytes"}) stats.erase(key);
    return stats;
  }

  // Kills builds at random moments; what is finished in the end is as if nothing had happened.
  void expect_same_file(const Arguments& options) {
    const auto start = Clock::now();
    const auto plain = run(build(expected, options));
    ASSERT_EQ(plain.status, 0) << plain.err;
    std::chrono::duration<double> time = Clock::now() - start;
    const auto seed = std::random_device()();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (int kills = 0; kills < kKills;) {
      const auto begin = Clock::now();
      Process process(resumed(options));
      std::this_thread::sleep_for(time * std::uniform_real_distribution(0.0, 1.0)(random));
      process.signal(SIGKILL);
      const auto ended = process.wait();
      if (ended.status == 128 + SIGKILL) {
        ++kills;
        continue;
      }
      ASSERT_EQ(ended.status, 0) << ended.err;
      ASSERT_TRUE(contents_of(expected) == contents_of(out));
      std::filesystem::remove(out);
      time = std::min<std::chrono::duration<double>>(time, Clock::now() - begin);
    }
    const auto made = run(resumed(options));
    ASSERT_EQ(made.status, 0) << made.err;
    EXPECT_TRUE(contents_of(expected) == contents_of(out));
    EXPECT_EQ(without_time(made.out), without_time(plain.out));
    expect_nothing_left();
  }
  // Of builds but what they were to make; a build that is killed as it writes its output leaves the temporary file of that.
  void expect_nothing_left() const {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
      EXPECT_THAT(entry.path().filename().string(), ::testing::AnyOf(HasSubstr(".nrrd"), "expected.ivm", "out.ivm", StartsWith(".intervale-")));
  }

  // All that a build keeps until its end: of a file with another name, which it does not remove.
  [[nodiscard]] std::string whole_journal(const Arguments& options) const {
    const auto other = folder / "other";
    folder.file("out.ivm.resume", "");
    std::filesystem::create_hard_link(journal, other);
    EXPECT_EQ(run(resumed(options)).status, 0);
    std::filesystem::remove(out);
    std::string bytes = contents_of(other);
    std::filesystem::remove(other);
    return bytes;
  }
  // Before a command: no file that it writes may be longer, in blocks of 512 bytes.
  static Arguments limited(std::size_t blocks) { return {"/bin/sh", "-c", "ulimit -f \"$1\"; shift; exec \"$@\"", "sh", std::to_string(blocks)}; }
  void put_journal(const std::string& bytes) const { folder.file("out.ivm.resume", bytes); }
};

TEST_F(ResumedBuild, OfEveryRangeIsTheSameFile) { expect_same_file({}); }
TEST_F(ResumedBuild, OfOneRangeIsTheSameFile) { expect_same_file({"--range", "20000", "30000"}); }
TEST_F(ResumedBuild, OfARangeWithNothingInItIsTheSameFile) { expect_same_file({"--range", "70000", "80000"}); }
TEST_F(ResumedBuild, WithAChannelIsTheSameFile) { expect_same_file({"--channel", "again=" + volume}); }
TEST_F(ResumedBuild, OfOneRangeWithAChannelIsTheSameFile) {
  expect_same_file({"--range", "20000", "30000", "--refine", "uniform", "--channel", "again=" + volume});
}
TEST_F(ResumedBuild, WithinABudgetIsTheSameFile) { expect_same_file({"--memory", "128MiB"}); }

TEST_F(ResumedBuild, SaysWhatItTakesOver) {
  const Arguments options{"--channel", "again=" + volume};
  ASSERT_EQ(run(build(expected, options)).status, 0);
  const std::string whole = whole_journal(options);
  put_journal(whole.substr(0, whole.size() - 1));
  const auto made = run(resumed(options));
  EXPECT_EQ(made.status, 0);
  const std::string line =
      "^intervale: going on from '" + journal + "': values known, 1 of 1 channels known, ([0-9]+) of ([0-9]+) pages compressed\n$";
  std::smatch pages;
  ASSERT_TRUE(std::regex_match(made.err, pages, std::regex(line))) << made.err;
  EXPECT_EQ(std::stoi(pages[1]) + 1, std::stoi(pages[2]));
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  expect_nothing_left();
}

// The errors come first in the journal; the values that follow have not been there yet.
TEST_F(ResumedBuild, GoesOnFromTheErrorsOfSomeScales) {
  ASSERT_EQ(run(build(expected, {})).status, 0);
  const std::size_t blocks = whole_journal({}).size() * 3 / 5 / 512;
  const auto full = run(limited(blocks) + resumed({}));
  EXPECT_EQ(full.status, 1);
  const auto made = run(resumed({}));
  EXPECT_EQ(made.status, 0);
  EXPECT_THAT(made.err, ContainsRegex("^intervale: going on from '.*': errors of [0-9]+ scales known\n$"));
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  expect_nothing_left();
}

TEST_F(ResumedBuild, WithOtherOptionsOrAnotherInputStartsAnew) {
  const std::string anew =
      "intervale: warning: '" + journal + "' is of another input, of other options or of another version: the build starts anew\n";
  const Arguments other{"--range", "20000", "30000"};
  const std::string whole = whole_journal({});
  ASSERT_EQ(run(build(expected, other)).status, 0);
  put_journal(whole);
  EXPECT_EQ(run(resumed(other)).err, anew);
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", kResumedSide, "--type", "u16", "-o", volume}).status, 0);
  ASSERT_EQ(run(build(expected, {})).status, 0);
  put_journal(whole);
  EXPECT_EQ(run(resumed({})).err, anew);
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  expect_nothing_left();
}

TEST_F(ResumedBuild, WithoutItsInputFailsAndKeepsWhatIsFinished) {
  const std::string whole = whole_journal({});
  put_journal(whole);
  std::filesystem::remove(volume);
  const auto made = run(resumed({}));
  EXPECT_EQ(made.status, 1);
  EXPECT_EQ(made.err, "intervale: cannot read '" + volume + "': No such file or directory\n");
  EXPECT_TRUE(contents_of(journal) == whole);
}

TEST_F(ResumedBuild, WhatIsDamagedIsBuiltAgain) {
  ASSERT_EQ(run(build(expected, {})).status, 0);
  const std::string whole = whole_journal({});
  for (const double place : {0.6, 0.75, 0.9, 0.99}) {
    std::string damaged = whole;
    damaged[std::size_t(double(whole.size()) * place)] ^= 1;
    put_journal(damaged);
    const auto made = run(resumed({}));
    EXPECT_EQ(made.status, 0);
    EXPECT_THAT(made.err, HasSubstr("intervale: warning: '" + journal + "' is damaged: what was finished there is built again\n"));
    EXPECT_TRUE(contents_of(expected) == contents_of(out)) << place;
    expect_nothing_left();
  }
}

TEST_F(ResumedBuild, AtTheSameTimeAsAnotherIsRefused) {
  const int held = ::open(journal.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  ASSERT_EQ(::flock(held, LOCK_EX), 0);
  const auto second = run(resumed({}));
  EXPECT_EQ(second.status, 1);
  EXPECT_EQ(second.err, "intervale: another build has '" + journal + "' in use: wait for it, or choose another output\n");
  EXPECT_FALSE(std::filesystem::exists(out));
  ::close(held);
  EXPECT_EQ(run(resumed({})).status, 0);
}

TEST_F(ResumedBuild, KeepsWhatIsFinishedInTheScratchFolder) {
  const auto scratch = folder / "scratch";
  std::filesystem::create_directory(scratch);
  {
    Process process(resumed({"--scratch", scratch}));
    const auto until = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < until && std::filesystem::is_empty(scratch)) std::this_thread::yield();
    process.signal(SIGKILL);
    process.wait();
  }
  ASSERT_FALSE(std::filesystem::is_empty(scratch));
  EXPECT_THAT(std::filesystem::directory_iterator(scratch)->path().filename().string(), ContainsRegex("^out.ivm-[0-9a-f]*.resume$"));
  EXPECT_EQ(run(resumed({"--scratch", scratch})).status, 0);
  EXPECT_TRUE(std::filesystem::is_empty(scratch));
  EXPECT_FALSE(std::filesystem::exists(journal));
}

TEST_F(ResumedBuild, AFullDiskIsOneLineAndLeavesNothing) {
  const std::string script =
      "mount -t tmpfs -o size=64k none \"$1\" || exit 77; \"$2\" build \"$3\" -o \"$4\" --resume --scratch \"$1\"; s=$?; ls -A \"$1\"; exit $s";
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  const auto full = run({"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", disk, program("intervale"), volume, out});
  if (full.status != 1) GTEST_SKIP() << "no small disk can be had here: " << full.err;
  EXPECT_THAT(full.err, AllOf(StartsWith("intervale: cannot write '" + disk.string()), HasSubstr("No space left on device")));
  EXPECT_EQ(std::count(full.err.begin(), full.err.end(), '\n'), 1) << full.err;
  EXPECT_EQ(full.out, "");
  EXPECT_FALSE(std::filesystem::exists(out));
}

// A limit of file sizes, which a test can have everywhere, stands for a disk.
TEST_F(ResumedBuild, GoesOnOnceThereIsRoomAgain) {
  ASSERT_EQ(run(build(expected, {})).status, 0);
  const std::size_t blocks = (whole_journal({}).size() - 1) / 512;
  const auto full = run(limited(blocks) + resumed({}));
  EXPECT_EQ(full.status, 1);
  EXPECT_EQ(full.err, "intervale: cannot write '" + journal + "': File too large\n");
  EXPECT_FALSE(std::filesystem::exists(out));
  const auto made = run(resumed({}));
  EXPECT_EQ(made.status, 0);
  EXPECT_THAT(made.err, StartsWith("intervale: going on from '" + journal + "': values known, "));
  EXPECT_TRUE(contents_of(expected) == contents_of(out));
  expect_nothing_left();
}

}  // namespace
}  // namespace intervale
