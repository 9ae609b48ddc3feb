// What goes wrong on the machine that a server runs on: descriptors, disks, clocks. README.md in tests/ has the table
// of faults.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "server/serve/catalogue_watcher.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

void limit_descriptors(const Process& process, rlim_t most) {
  rlimit limit{};
  ASSERT_EQ(::prlimit(process.id(), RLIMIT_NOFILE, nullptr, &limit), 0);
  limit.rlim_cur = std::min(most, limit.rlim_max);
  ASSERT_EQ(::prlimit(process.id(), RLIMIT_NOFILE, &limit, nullptr), 0);
}

TEST(Faults, WithoutDescriptorsWhoIsInGoesOnAndOthersComeInLater) {
  ServerProgram server;
  const std::uint64_t all = everything(server.port());
  Waiting inside(server.port());
  limit_descriptors(server.process(), descriptors_of(server.process().id()) + 4);
  {
    boost::asio::io_context io;
    std::vector<boost::asio::ip::tcp::socket> sockets;
    for (int i = 0; i < 32; ++i) sockets.emplace_back(io).connect({boost::asio::ip::address_v4::loopback(), server.port()});
    EXPECT_TRUE(server.process().wait_for("cannot accept a connection: Too many open files"));
    EXPECT_EQ(inside.finish(), all);
  }
  EXPECT_THAT(get(server.port(), "/readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(everything(server.port()), all);
}

// What the server reads while it runs, it reads once it can: a token that was taken out must not stay.
TEST(Faults, WithoutDescriptorsFilesAreReadLater) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer opens a pipe to look at an object of a new type, and takes it for none if it cannot";
#endif
  const TempDir folder;
  const std::filesystem::path data = folder / "data", tokens = folder.file("tokens", "old\n");
  std::filesystem::create_directory(data);
  std::filesystem::copy_file(buckyball(), data / "a.ivm");
  ServerProgram server(data, {"--tokens", tokens});
  limit_descriptors(server.process(), 0);
  folder.file("tokens", "replaced\n");
  std::filesystem::copy_file(buckyball(), data / "b.ivm");
  const auto all_of = [&server](const std::vector<std::string>& said) {
    return std::all_of(said.begin(), said.end(), [&server](const std::string& text) { return server.process().wait_for(text).has_value(); });
  };
  EXPECT_TRUE(
      all_of({"data: Too many open files; the data read before stays in use", "tokens: Too many open files; the data read before stays in use"}));
  limit_descriptors(server.process(), 1024);
  EXPECT_TRUE(all_of({"reloaded the tokens", "b.ivm was loaded"}));
  EXPECT_EQ(run({program("intervale-client"), "list", server.url(), "--token", "old"}).status, 1);
  const auto listed = run({program("intervale-client"), "list", server.url(), "--token", "replaced"});
  EXPECT_THAT(listed.out, ::testing::AllOf(HasSubstr("a"), HasSubstr("b")));
}

TEST(Faults, ADiskThatFillsUpWhileBuildingIsOneLineAndKeepsWhatWasThere) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "65", "-o", volume}).status, 0);
  const auto full = run({program("intervale"), "build", volume, "-o", "/dev/full", "--range", "128", "188"});
  EXPECT_EQ(full.status, 1);
  EXPECT_EQ(full.err, "intervale: cannot write '/dev/full': No space left on device\n");

  // A disk of 64 KiB, seen by this command alone; prints what is on it at the end.
  const std::string script =
      "mount -t tmpfs -o size=64k none \"$1\" || exit 77; echo before > \"$1/x.ivm\"; \"$2\" build \"$3\" -o \"$1/x.ivm\" --range 128 188; "
      "status=$?; ls -A \"$1\"; cat \"$1/x.ivm\"; exit $status";
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  const auto small = run({"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", disk, program("intervale"), volume});
  if (small.status != 1) GTEST_SKIP() << "no small disk can be had here: " << small.err;
  EXPECT_THAT(small.err, ::testing::AllOf(StartsWith("intervale: cannot write '"), HasSubstr("No space left on device")));
  EXPECT_EQ(std::count(small.err.begin(), small.err.end(), '\n'), 1) << small.err;
  EXPECT_EQ(small.out, "x.ivm\nbefore\n");
}

TEST(Faults, ALimitOfFileSizesIsOneLineAndKeepsWhatWasThere) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "65", "-o", volume}).status, 0);
  const auto target = folder / "to";
  std::filesystem::create_directory(target);
  const std::string file = folder.file("to/x.ivm", "before");
  const auto limited =
      run({"/bin/sh", "-c", "ulimit -f 16; exec \"$@\"", "sh", program("intervale"), "build", volume, "-o", file, "--range", "128", "188"});
  EXPECT_EQ(limited.status, 1);
  EXPECT_EQ(limited.err, "intervale: cannot write '" + file + "': File too large\n");
  EXPECT_EQ(contents_of(file), "before");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(target), std::filesystem::directory_iterator{}), 1);
}

// The running server's own clock, that of the wall, by a day; its log tells.
TEST(Faults, AClockThatIsSetMattersToNobody) {
  const char* const faketime = "/usr/lib/" INTERVALE_ARCHITECTURE "/faketime/libfaketimeMT.so.1";
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer's runtime would have to come before faketime's";
#endif
  if (::access(faketime, R_OK) != 0) GTEST_SKIP() << "no faketime here";
  const TempDir folder;
  const std::string clock = folder / "clock";
  const auto set_clock = [&](const std::string& offset) { std::filesystem::rename(folder.file("clock.new", offset), clock); };
  set_clock("+0");
  const auto data = folder / "data";
  std::filesystem::create_directory(data);
  std::filesystem::copy_file(buckyball(), data / "buckyball.ivm");
  ServerProgram server(data, {"--log-level", "debug"},
                       {std::string("LD_PRELOAD=") + faketime, "FAKETIME_TIMESTAMP_FILE=" + clock, "FAKETIME_NO_CACHE=1",
                        "FAKETIME_DONT_FAKE_MONOTONIC=1", "NO_FAKE_STAT=1"});
  const std::uint64_t all = everything(server.port());
  Waiting inside(server.port());
  for (const std::string offset : {"-1d", "+1d", "-1d"}) {
    set_clock(offset);
    EXPECT_EQ(everything(server.port()), all) << offset;
  }
  EXPECT_EQ(inside.finish(), all);
  std::filesystem::copy_file(buckyball(), data / "later.ivm");
  const auto said = server.process().wait_for("later.ivm was loaded");
  ASSERT_TRUE(said);
  std::set<std::string> days;
  std::istringstream lines(*said);
  for (std::string line; std::getline(lines, line);) days.insert(line.substr(0, 10));
  EXPECT_GE(days.size(), 2u) << "the clock was not set: " << *said;
}

// As a clock that was set back makes it.
TEST(Faults, AFileOlderThanTheOneItReplacesIsTakenUp) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd", path = folder / "served.ivm";
  const auto build = [&](const char* low) { return run({program("intervale"), "build", volume, "-o", path, "--range", low, "188"}).status; };
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "17", "-o", volume}).status, 0);
  ASSERT_EQ(build("128"), 0);
  Memory memory;
  CatalogueWatcher watcher({folder.path()}, memory);
  const auto before = watcher.load().value().find("served");
  const auto time = std::filesystem::last_write_time(path);
  ASSERT_EQ(build("100"), 0);
  std::filesystem::last_write_time(path, time - std::chrono::hours(24));
  EXPECT_FALSE(watcher.poll()) << "it may be under way";
  const auto changed = watcher.poll();
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->find("served")->description().range.alpha, 100);
  EXPECT_EQ(before->description().range.alpha, 128);
}

}  // namespace
}  // namespace intervale
