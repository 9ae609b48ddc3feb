// Files whose checksums are right and whose contents lie are refused: in one line, at once, and in little memory. How a
// server takes them: e2e/evil_files_test.cpp.
#include "tests/support/evil_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <set>
#include <string>

#include "common/ivm/load_volume.h"

namespace intervale::evil_files {
namespace {

using ::testing::HasSubstr;

// Of this process, in KiB: VmRSS: resident now; VmHWM: the most since the peak was forgotten.
std::uint64_t memory_of(const std::string& what) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    std::uint64_t kib = 0;
    if (word == what + ":" && status >> kib) return kib;
  }
  return 0;
}

TEST(EvilContents, TheFilesAreGoodButForTheirLies) {
  for (const auto& bytes : {testing::good_file_of_one_range(), testing::good_file_of_every_range()}) {
    const auto volume = decode_volume(bytes, "good");
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->description().channels.size(), 2u);
  }
}

TEST(EvilContents, AreRefusedInOneLineAtOnceAndInLittleMemory) {
  const auto files = testing::evil_files();
  EXPECT_EQ(files.size(), 176u);
  std::set<std::string> names;
  for (const testing::EvilFile& file : files) {
    SCOPED_TRACE(file.name);
    EXPECT_TRUE(names.insert(file.name).second) << "twice";
    std::ofstream("/proc/self/clear_refs") << 5;                       // forgets the peak
    [[maybe_unused]] const std::uint64_t before = memory_of("VmRSS");  // not under the sanitizer, which keeps freed memory
    const auto start = std::chrono::steady_clock::now();
    const auto volume = decode_volume(file.bytes, "evil");
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
#ifndef __SANITIZE_ADDRESS__
    EXPECT_LT(memory_of("VmHWM"), before + (32 << 10)) << "KiB";
#endif
    EXPECT_FALSE(volume);
    if (volume) continue;
    const std::string& message = volume.error().message;
    EXPECT_THAT(message, HasSubstr(file.about));
    EXPECT_TRUE(!message.empty() && std::none_of(message.begin(), message.end(), [](unsigned char c) { return c < 0x20; })) << message;
  }
}

}  // namespace
}  // namespace intervale::evil_files
