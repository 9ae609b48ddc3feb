#include "server/resume/build_journal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint64_t kFingerprint = 7;

struct JournalTest : ::testing::Test {
  TempDir folder;
  std::filesystem::path path = folder / "out.ivm.resume";
  std::vector<std::string> warnings;

  Result<std::unique_ptr<BuildJournal>> try_open(std::uint64_t fingerprint = kFingerprint) {
    return BuildJournal::open(path, fingerprint, [this](const std::string& what) { warnings.push_back(what); });
  }
  std::unique_ptr<BuildJournal> open(std::uint64_t fingerprint = kFingerprint) {
    auto journal = try_open(fingerprint);
    EXPECT_TRUE(journal) << journal.error().message;
    return std::move(*journal);
  }
  static void append(BuildJournal& journal, const BuildJournal::Name& name, const std::string& text) {
    journal.append(name, std::as_bytes(std::span(text)));
  }
  static std::optional<std::string> read(BuildJournal& journal, const BuildJournal::Name& name) {
    BuildJournal::Reader reader(journal, name);
    std::string text(reader.left(), '\0');
    const bool is_read = reader.read(std::as_writable_bytes(std::span(text)));
    if (!reader.is_intact()) return {};
    EXPECT_TRUE(is_read);
    return text;
  }
  // Two short records, and a long one before them that was written in pieces.
  void make_journal() {
    const auto journal = open();
    BuildJournal::Writer writer(*journal, {1});
    for (const std::string piece : {"one, ", "two, ", "three"}) writer.write(std::as_bytes(std::span(piece)));
    writer.end();
    append(*journal, {2, 0, 5}, "five");
    append(*journal, {2, 1, 0}, "");
  }
};

TEST_F(JournalTest, WhatWasWrittenIsThereLater) {
  make_journal();
  const auto journal = open();
  EXPECT_EQ(read(*journal, {1}), "one, two, three");
  EXPECT_EQ(read(*journal, {2, 0, 5}), "five");
  EXPECT_EQ(read(*journal, {2, 1, 0}), "");
  EXPECT_EQ(read(*journal, {2, 0, 6}), std::nullopt);
  EXPECT_EQ(journal->count(1), 1);
  EXPECT_EQ(journal->count(2), 2);
  EXPECT_EQ(journal->count(3), 0);
  append(*journal, {2, 0, 5}, "five again");
  EXPECT_EQ(read(*journal, {2, 0, 5}), "five again");
  EXPECT_EQ(journal->count(2), 2);
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(JournalTest, ARecordThatIsNotEndedIsDroppedAndNobodyIsWarned) {
  make_journal();
  const auto bytes = std::filesystem::file_size(path);
  {
    const auto journal = open();
    BuildJournal::Writer writer(*journal, {3});
    const std::vector<std::byte> much(3 << 20, std::byte(1));
    writer.write(much);
    EXPECT_GT(std::filesystem::file_size(path), much.size());
  }
  const auto journal = open();
  EXPECT_EQ(std::filesystem::file_size(path), bytes);
  EXPECT_EQ(read(*journal, {3}), std::nullopt);
  EXPECT_EQ(read(*journal, {1}), "one, two, three");
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(JournalTest, EveryTruncationLeavesWholeRecords) {
  make_journal();
  const std::string whole = contents_of(path);
  for (std::size_t bytes = 0; bytes <= whole.size(); ++bytes) {
    std::filesystem::remove(path);
    folder.file("out.ivm.resume", whole.substr(0, bytes));
    std::size_t records = 0;
    {
      const auto journal = open();
      for (const auto& [name, text] : {std::pair(BuildJournal::Name{1}, "one, two, three"), {{2, 0, 5}, "five"}, {{2, 1, 0}, ""}}) {
        const auto found = read(*journal, name);
        if (!found) continue;
        EXPECT_EQ(found, text);
        ++records;
      }
      append(*journal, {4}, "more");
    }
    const auto journal = open();
    EXPECT_EQ(read(*journal, {4}), "more") << bytes;
    EXPECT_EQ(journal->count(1) + journal->count(2), records) << bytes;
    EXPECT_EQ(records == 3, bytes == whole.size());
  }
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(JournalTest, EveryFlippedByteIsFound) {
  make_journal();
  const std::string whole = contents_of(path);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    for (const int bits : {1, 0x80, 0xff}) {
      std::string damaged = whole;
      damaged[at] = char(damaged[at] ^ bits);
      folder.file("out.ivm.resume", damaged);
      warnings.clear();
      const auto journal = try_open();
      if (!journal) {
        EXPECT_LT(at, 8) << "the file is not known any more";
        EXPECT_EQ(contents_of(path), damaged);
        continue;
      }
      std::size_t records = 0;
      for (const auto& [name, text] : {std::pair(BuildJournal::Name{1}, "one, two, three"), {{2, 0, 5}, "five"}, {{2, 1, 0}, ""}}) {
        const auto found = read(**journal, name);
        if (!found) continue;
        EXPECT_EQ(found, text);
        ++records;
      }
      EXPECT_LT(records, 3) << at;
      EXPECT_EQ(warnings.size(), 1) << at;
    }
  }
}

TEST_F(JournalTest, OfAnotherFingerprintIsEmptied) {
  make_journal();
  {
    const auto journal = open(kFingerprint + 1);
    EXPECT_THAT(warnings, ElementsAre(HasSubstr("the build starts anew")));
    EXPECT_EQ(read(*journal, {1}), std::nullopt);
    append(*journal, {5}, "other");
  }
  EXPECT_EQ(read(*open(kFingerprint + 1), {5}), "other");
  EXPECT_EQ(warnings.size(), 1);
}

TEST_F(JournalTest, OneBuildHasItAtATime) {
  const auto first = open();
  const auto second = try_open();
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another build has '" + path.string() + "' in use"));
  append(*first, {1}, "first");
  EXPECT_EQ(read(*first, {1}), "first");
}

TEST_F(JournalTest, WithoutRecordsNoFileIsLeft) {
  { EXPECT_TRUE(std::filesystem::exists(open()->path())); }
  EXPECT_FALSE(std::filesystem::exists(path));
  make_journal();
  open()->remove();
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_F(JournalTest, AnotherFileIsLeftAlone) {
  folder.file("out.ivm.resume", "a letter");
  EXPECT_THAT(try_open().error().message, HasSubstr("is another file: remove it"));
  EXPECT_EQ(contents_of(path), "a letter");
  std::filesystem::remove(path);
  std::filesystem::create_directory(path);
  EXPECT_FALSE(try_open());
  EXPECT_TRUE(std::filesystem::is_directory(path));
}

}  // namespace
}  // namespace intervale
