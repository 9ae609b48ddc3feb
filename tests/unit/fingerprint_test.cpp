#include "server/resume/fingerprint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;

std::uint64_t fingerprint_of(const std::filesystem::path& input, const std::vector<std::filesystem::path>& left_out = {}) {
  Fingerprint fingerprint;
  const auto ok = fingerprint.add_input(input, left_out);
  EXPECT_TRUE(ok) << ok.error().message;
  return fingerprint.value();
}

template <class... Values>
std::uint64_t fingerprint_of_values(const Values&... values) {
  Fingerprint fingerprint;
  (fingerprint.add(values), ...);
  return fingerprint.value();
}

TEST(Fingerprint, ValuesThatDifferOrMoveChangeIt) {
  const std::optional<double> none, zero = 0.0;
  const std::vector<std::string> one{"ab"}, two{"a", "b"};
  EXPECT_EQ(fingerprint_of_values(one, none), fingerprint_of_values(one, none));
  EXPECT_NE(fingerprint_of_values(one), fingerprint_of_values(two));
  EXPECT_NE(fingerprint_of_values(none), fingerprint_of_values(zero));
  EXPECT_NE(fingerprint_of_values(none, zero), fingerprint_of_values(zero, none));
  EXPECT_NE(fingerprint_of_values(std::string("a"), std::string()), fingerprint_of_values(std::string(), std::string("a")));
}

TEST(Fingerprint, AFileThatChangesOrMovesChangesIt) {
  const TempDir folder;
  const auto file = folder.file("volume.raw", "samples");
  const auto before = fingerprint_of(file);
  EXPECT_EQ(fingerprint_of(file), before);
  const auto time = std::filesystem::last_write_time(file);
  std::filesystem::last_write_time(file, time + std::chrono::nanoseconds(1000));
  EXPECT_NE(fingerprint_of(file), before);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  do {  // the system's clock of files may stand still for some milliseconds
    folder.file("volume.raw", "SAMPLES");
    std::filesystem::last_write_time(file, time);
  } while (fingerprint_of(file) == before && std::chrono::steady_clock::now() < until);
  EXPECT_NE(fingerprint_of(file), before) << "of the same size and time";
  const auto now = fingerprint_of(file);
  std::filesystem::create_hard_link(file, folder / "other.raw");
  EXPECT_NE(fingerprint_of(folder / "other.raw"), now);
}

TEST(Fingerprint, AHeadersDataCounts) {
  const TempDir folder;
  const auto header = folder.file("volume.nhdr", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: volume.data\n");
  Fingerprint alone;
  EXPECT_THAT(alone.add_input(header, {}).error().message, HasSubstr("volume.data': No such file or directory"));
  folder.file("volume.data", "01234567");
  const auto before = fingerprint_of(header);
  EXPECT_EQ(fingerprint_of(header), before);
  folder.file("volume.data", "012345678");
  EXPECT_NE(fingerprint_of(header), before);
}

TEST(Fingerprint, OfAFolderIsOfItsFilesButThoseLeftOut) {
  const TempDir folder;
  std::filesystem::create_directory(folder / "slices");
  folder.file("slices/0", "0");
  const auto before = fingerprint_of(folder.path(), {folder / "out.ivm", folder / "out.ivm.resume"});
  folder.file("out.ivm.resume", "kept");
  folder.file(".intervale-1-2-3.part", "half");
  EXPECT_EQ(fingerprint_of(folder.path(), {folder / "out.ivm", folder / "out.ivm.resume"}), before);
  EXPECT_NE(fingerprint_of(folder.path()), before);
  folder.file("slices/1", "1");
  EXPECT_NE(fingerprint_of(folder.path(), {folder / "out.ivm", folder / "out.ivm.resume"}), before);
}

TEST(Fingerprint, WhatIsNotThereFails) {
  const TempDir folder;
  Fingerprint fingerprint;
  EXPECT_THAT(fingerprint.add_input(folder / "none", {}).error().message, HasSubstr("none': No such file or directory"));
}

}  // namespace
}  // namespace intervale
