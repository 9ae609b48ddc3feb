// Files with right checksums that claim much more than they hold.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/codec/byte_planes.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/value_page.h"
#include "tests/support/complaints.h"
#include "tests/support/evil_files.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

constexpr std::uint64_t kBricks = 60'000, kSupercubes = kBricks * 64, kUpdates = kSupercubes * kSlots;  // 215 million

void put_plane(std::vector<std::byte>& stream, const std::vector<std::uint8_t>& contents) {
  std::vector<std::uint8_t> stored;
  append_plane(stored, contents, 1);
  stream.clear();
  append<std::uint8_t>(stream, stored);
}

// Of so many full bricks of scale 0, side by side.
SupercubeSet full_set() {
  std::vector<SupercubeKey> keys;
  keys.reserve(kSupercubes);
  for (std::uint64_t s = 0; s < kSupercubes; ++s) keys.push_back(supercube_key(0, {0, 0, 0}) + s);
  return {keys, std::vector<std::uint64_t>(kSupercubes, (std::uint64_t(1) << kSlots) - 1)};
}

// The buckyball's file, with another set: it takes what repeats, and no page holds its values.
std::vector<std::byte> evil_file() {
  std::ifstream in(buckyball(), std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto file = Container::open(std::as_bytes(std::span(text)), FileScope::one_range).value();
  Streams streams;
  for (std::uint32_t type = 1; type < kStreamTypes; ++type) {
    const auto stream = file[StreamType(type)];
    streams[StreamType(type)].assign(stream.begin(), stream.end());
  }
  const std::uint64_t counts[] = {kUpdates, 0, kSupercubes, kBricks};
  std::memcpy(streams[StreamType::range].data() + 24, counts, sizeof counts);
  std::vector<std::uint8_t> steps;
  append_varint(steps, supercube_key(0, {0, 0, 0}) >> 6);
  steps.insert(steps.end(), kBricks - 1, 1);
  put_plane(streams[StreamType::bricks], steps);
  put_plane(streams[StreamType::masks], std::vector<std::uint8_t>(kBricks * 8, 0xff));
  put_plane(streams[StreamType::occupancy], std::vector<std::uint8_t>(kSupercubes * 7, 0xff));
  put_plane(streams[StreamType::error_to_distance], std::vector<std::uint8_t>(kSupercubes, 0));
  streams[StreamType::error_steps].assign(40'000, std::byte(0));
  const std::vector<std::uint8_t> page(500, 0x5a);
  streams[StreamType::page_index].clear();
  streams[StreamType::pages].clear();
  for (std::size_t pages = pages_of(full_set()).size(); pages > 0; --pages) {
    append(streams[StreamType::page_index],
           std::span<const std::uint64_t>(std::vector<std::uint64_t>{page.size(), XXH3_64bits(page.data(), page.size())}));
    append<std::uint8_t>(streams[StreamType::pages], page);
  }
  return make_container(FileScope::one_range, streams);
}

struct EvilFiles : ::testing::Test {
  TempDir folder;
  std::string evil;
  EvilFiles() {
    const auto bytes = evil_file();
    EXPECT_LT(bytes.size(), 1u << 20);
    evil = folder.file("evil.ivm", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    std::filesystem::copy_file(buckyball(), folder / "buckyball.ivm");
  }
  // The most that a server of both files had resident until it served, in MiB.
  static std::uint64_t peak(ServerProgram& server) {
    std::ifstream status("/proc/" + std::to_string(server.process().id()) + "/status");
    for (std::string word; status >> word;) {
      std::uint64_t kib = 0;
      if (word == "VmHWM:" && status >> kib) return kib / 1024;
    }
    return ~std::uint64_t(0);
  }
  static void expect_peak(ServerProgram& server, std::uint64_t most) {
    const std::uint64_t megabytes = peak(server);
#ifdef __SANITIZE_ADDRESS__
    most += 192;  // the sanitizer's shadow, and what it keeps of freed memory
#endif
    EXPECT_LT(megabytes, most);
  }
};

TEST_F(EvilFiles, WhatTakesMoreThanTheLimitIsNotRead) {
  ServerProgram server(folder.path().string(), {"--max-memory", "300MB"});
  expect_peak(server, 64);
  EXPECT_GT(everything(server.port()), 0u) << "the other file is served";
  EXPECT_THAT(get(server.port(), "/api/datasets"), Not(HasSubstr("evil")));
}

TEST_F(EvilFiles, WithoutALimitWhatIsNotThereTakesLittle) {
  ServerProgram server(folder.path().string());
  expect_peak(server, 400);  // the keys alone would take as much as there are updates
  EXPECT_THAT(get(server.port(), "/api/datasets"), Not(HasSubstr("evil")));
  const Finished finished = run({program("intervale"), "info", evil});
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.err, HasSubstr("is damaged"));
}

// Each with another lie; what is wrong with them is told in one line each.
TEST(EvilFolder, IsServedButForItsEvilFiles) {
  const TempDir folder;
  std::filesystem::copy_file(buckyball(), folder / "buckyball.ivm");
  const auto files = testing::evil_files();
  for (const testing::EvilFile& file : files)
    folder.file(file.name + ".ivm", std::string_view(reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()));
  ServerProgram server(folder.path().string());
  EXPECT_GT(everything(server.port()), 0u);
  EXPECT_THAT(get(server.port(), "/api/datasets"), ::testing::AllOf(HasSubstr("buckyball"), Not(HasSubstr("one-")), Not(HasSubstr("every-"))));
  server.process().signal(SIGTERM);
  const std::string log = server.process().wait().err;
  for (const testing::EvilFile& file : files) {
    const std::size_t at = log.find("skipped: " + (folder / (file.name + ".ivm")).string() + ": ");
    ASSERT_NE(at, std::string::npos) << file.name;
    EXPECT_THAT(log.substr(at, log.find('\n', at) - at), HasSubstr(file.about)) << "in that line";
  }
}

}  // namespace
}  // namespace intervale
