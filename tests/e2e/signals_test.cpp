// Signals to a server that is busy: the first one drains, the second one ends it at once.
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kHeard{500};  // 100, and what a busy machine adds

// A file that takes a second or so to read; made once a run.
const std::filesystem::path& large_file() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    const std::string volume = folder / "gyroid.nrrd", made = folder / "gyroid.ivm";
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "161", "-o", volume}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", volume, "-o", made}).status, 0);
    return std::filesystem::path(made);
  }();
  return path;
}

std::vector<std::string> serving(const std::filesystem::path& folder) {
  return {program("intervale"), "serve", folder, "--listen", "127.0.0.1:0", "--log-level", "debug"};
}

// Before anything is served, if files are read whole at once; and while they are served by their coarse scales.
TEST(Signals, AreHeardWhileFilesAreReadAtTheStart) {
  const TempDir folder;
  for (const char* name : {"a.ivm", "b.ivm", "c.ivm"}) std::filesystem::create_symlink(large_file(), folder / name);
  for (const bool is_whole : {true, false}) {
    std::vector<std::string> command = serving(folder.path());
    if (is_whole) command.emplace_back("--tolerate-damage");
    Process server(command);
    ASSERT_TRUE(server.wait_for("reads "));
    const auto begun = Clock::now();
    server.signal(SIGTERM);
    const Finished finished = server.wait();
    EXPECT_LT(Clock::now() - begun, kHeard);
    EXPECT_EQ(finished.status, 0);
    EXPECT_EQ(finished.err.find("serving") == std::string::npos, is_whole) << finished.err;
  }
}

TEST(Signals, AreHeardWhileAFileThatAppearsIsRead) {
  const TempDir folder;
  Process server(serving(folder.path()));
  ASSERT_TRUE(server.wait_for("serving"));
  std::filesystem::create_symlink(large_file(), folder / "a.ivm");
  ASSERT_TRUE(server.wait_for("reads "));
  const auto begun = Clock::now();
  server.signal(SIGTERM);
  ASSERT_TRUE(server.wait_for("draining"));
  EXPECT_LT(Clock::now() - begun, kHeard);
  EXPECT_EQ(server.wait().status, 0);
  EXPECT_LT(Clock::now() - begun, 2 * kHeard);
}

TEST(Signals, TheSecondEndsAServerThatDrains) {
  ServerProgram server(buckyball().string(), {"--drain-time", "60"});
  const Waiting deaf(server.port());
  server.process().signal(SIGTERM);
  ASSERT_TRUE(server.process().wait_for("draining"));
  const auto begun = Clock::now();
  server.process().signal(SIGTERM);
  EXPECT_EQ(server.process().wait().status, 128 + SIGTERM);
  EXPECT_LT(Clock::now() - begun, kHeard);
}

}  // namespace
}  // namespace intervale
