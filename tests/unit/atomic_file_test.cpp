#include "common/util/atomic_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

namespace fs = std::filesystem;

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text.data(), text.size())); }

std::size_t entries(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator{}));
}

TEST(AtomicFile, NothingIsSeenBeforeCommit) {
  const TempDir folder;
  auto file = AtomicFile::create(folder / "out");
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->write(bytes_of("half")));
  EXPECT_FALSE(fs::exists(folder / "out"));
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(contents_of(folder / "out"), "half");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, AbandonedLeavesTheOldContentsAndNothingBeside) {
  const TempDir folder;
  folder.file("out", "old");
  {
    auto file = AtomicFile::create(folder / "out");
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->write(bytes_of("new")));
  }
  EXPECT_EQ(contents_of(folder / "out"), "old");
  EXPECT_EQ(entries(folder.path()), 1U);
}

TEST(AtomicFile, MovedFromOwnsNothing) {
  const TempDir folder;
  auto file = AtomicFile::create(folder / "out");
  ASSERT_TRUE(file);
  {
    AtomicFile moved(std::move(*file));
    ASSERT_TRUE(moved.write(bytes_of("x")));
    ASSERT_TRUE(moved.commit());
  }
  EXPECT_EQ(contents_of(folder / "out"), "x");
}

TEST(AtomicFile, WritesOfEverySizeAddUp) {
  const TempDir folder;
  auto file = AtomicFile::create(folder / "out");
  ASSERT_TRUE(file);
  std::string expected;
  for (const std::size_t size :
       {std::size_t{1}, (std::size_t{1} << 20) - 1, std::size_t{1} << 20, (std::size_t{1} << 20) + 1, std::size_t{0}, std::size_t{7}}) {
    const std::string part(size, static_cast<char>('a' + size % 26));
    ASSERT_TRUE(file->write(bytes_of(part)));
    expected += part;
  }
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(contents_of(folder / "out"), expected);
}

TEST(AtomicFile, ReplacesAndKeepsPermissions) {
  const TempDir folder;
  const auto path = folder.file("out", "old");
  fs::permissions(path, fs::perms::owner_read | fs::perms::owner_write);
  auto file = AtomicFile::create(path);
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->commit());
  EXPECT_EQ(contents_of(path), "");
  EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST(AtomicFile, ReplacesWhatALinkPointsTo) {
  const TempDir folder;
  const auto target = folder.file("target", "old");
  fs::create_symlink("target", folder / "link");
  auto file = AtomicFile::create(folder / "link");
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(bytes_of("new")));
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::is_symlink(folder / "link"));
  EXPECT_EQ(contents_of(target), "new");
}

TEST(AtomicFile, NamesAMissingFolderAtOnce) {
  const TempDir folder;
  const auto file = AtomicFile::create(folder / "no/out");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find((folder / "no").string()), std::string::npos) << file.error().message;
  EXPECT_NE(file.error().message.find("does not exist"), std::string::npos) << file.error().message;
}

TEST(AtomicFile, RefusesAFolderAndAFileUsedAsFolder) {
  const TempDir folder;
  EXPECT_FALSE(AtomicFile::create(folder.path()));
  EXPECT_FALSE(AtomicFile::create(folder.path().string() + "/new/"));
  folder.file("plain", "x");
  EXPECT_FALSE(AtomicFile::create(folder / "plain/out"));
  EXPECT_FALSE(AtomicFile::create(""));
}

TEST(AtomicFile, RefusesAReadOnlyFolder) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  const TempDir folder;
  fs::create_directory(folder / "locked");
  fs::permissions(folder / "locked", fs::perms::owner_read | fs::perms::owner_exec);
  const auto file = AtomicFile::create(folder / "locked/out");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find("Permission denied"), std::string::npos) << file.error().message;
}

TEST(AtomicFile, AFullDeviceIsNamedWithItsReason) {
  auto file = AtomicFile::create("/dev/full");
  ASSERT_TRUE(file) << file.error().message;
  const auto written = file->write(bytes_of(std::string(3 << 20, 'x')));
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().message, "cannot write '/dev/full': No space left on device");
  auto small = AtomicFile::create("/dev/full");
  ASSERT_TRUE(small);
  ASSERT_TRUE(small->write(bytes_of("x")));  // buffered
  EXPECT_FALSE(small->commit());
}

TEST(AtomicFile, ADeviceStaysADevice) {
  auto file = AtomicFile::create("/dev/null");
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(bytes_of("x")));
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST(AtomicFile, WritesIntoAPipe) {
  const TempDir folder;
  const auto path = folder / "pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  const int reader = ::open(path.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  auto file = AtomicFile::create(path);
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->write(bytes_of("hello")));
  ASSERT_TRUE(file->commit());
  char got[8];
  EXPECT_EQ(::read(reader, got, sizeof got), 5);
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST(AtomicFile, ALongNameStillHasRoomBeside) {
  const TempDir folder;
  const auto path = folder / std::string(255, 'n');
  auto file = AtomicFile::create(path);
  ASSERT_TRUE(file) << file.error().message;
  ASSERT_TRUE(file->commit());
  EXPECT_TRUE(fs::exists(path));
}

}  // namespace
}  // namespace intervale
