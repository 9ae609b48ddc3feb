#include "common/ivm/ivm_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>

#include "common/ivm/ivm_container.h"
#include "common/ivm/value_file.h"
#include "common/ivm/value_page.h"
#include "common/ivm/verify.h"
#include "common/parallel/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/equal_volumes.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"
#include "tests/support/special_values.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

IntervalVolume small_volume() { return testing::build(testing::gyroid({9, 7, 6}), {.range = {-0.3, 0.4}}); }

// A copy in a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<IntervalVolume> decode_exact(std::span<const std::byte> bytes) {
  const auto exact = std::make_unique<std::byte[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  return decode_ivm({exact.get(), bytes.size()}, "damaged");
}

bool is_one_line(const std::string& message) { return !message.empty() && message.find('\n') == std::string::npos; }

TEST(IvmFile, LoadingGivesBackWhatWasSaved) {
  const TempDir folder;
  const struct {
    unsigned kind;
    std::array<std::int32_t, 3> dims;
    Range range;
    Refine refine;
  } cases[] = {{0, {17, 17, 17}, {-0.3, 0.2}, Refine::boundary},
               {1, {5, 9, 3}, {3, 3}, Refine::boundary},
               {2, {12, 2, 7}, {80, kInf}, Refine::uniform},
               {0, {2, 2, 2}, {-kInf, kInf}, Refine::uniform},
               {0, {9, 9, 9}, {50, 60}, Refine::boundary}};
  for (const auto& c : cases) {
    Volume volume = c.kind == 0 ? testing::gyroid(c.dims) : c.kind == 1 ? testing::digits(c.dims, 1) : testing::bump(c.dims, 2);
    volume.grid.affine = Affine::of({0.5, 1, 3}, {-4, 0, 7});
    round_samples(volume, choose_value_format(volume, {}).value());
    const IntervalVolume sigma = testing::build(volume, {.range = c.range, .refine = c.refine});
    const auto path = folder / "first.second.ivm";
    ASSERT_TRUE(save_ivm(path, sigma));
    const auto loaded = load_ivm(path);
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ((*loaded)->description().name, "first.second");
    testing::expect_equal(sigma, **loaded);
    const auto valid = validate(**loaded);
    EXPECT_TRUE(valid) << valid.error().message;
  }
}

TEST(IvmFile, SlopesMayBeMissing) {
  const IntervalVolume sigma = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  auto parts = testing::parts_of(sigma);
  ASSERT_FALSE(parts.surface.slopes.empty());
  parts.surface.slopes.clear();
  const auto without = IntervalVolume::assemble(std::move(parts));
  ASSERT_TRUE(without);
  const auto decoded = decode_ivm(encode_ivm(*without), "without");
  ASSERT_TRUE(decoded) << decoded.error().message;
  testing::expect_equal(*without, *decoded);
  EXPECT_EQ(decoded->description().content_hash, decode_ivm(encode_ivm(sigma), "with")->description().content_hash) << "the mesh is the same";
}

TEST(IvmFile, EqualVolumesGiveEqualBytesWhateverTheirNames) {
  Volume volume = testing::gyroid({9, 9, 9});
  const auto bytes = encode_ivm(testing::build(volume, {.range = {-0.3, 0.2}}));
  volume.name = "another";
  EXPECT_EQ(encode_ivm(testing::build(volume, {.range = {-0.3, 0.2}})), bytes);
  const auto decoded = decode_ivm(bytes, "third");
  ASSERT_TRUE(decoded);
  EXPECT_EQ(encode_ivm(*decoded), bytes);
  EXPECT_NE(encode_ivm(testing::build(volume, {.range = {-0.3, 0.25}})), bytes);
}

TEST(IvmFile, EveryFlippedByteIsRefused) {
  const auto bytes = encode_ivm(small_volume());
  ASSERT_LT(bytes.size(), 16384u);
  std::mt19937 random(1);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    auto damaged = bytes;
    damaged[i] ^= std::byte(1 + random() % 255);
    const auto decoded = decode_exact(damaged);
    ASSERT_FALSE(decoded) << "byte " << i << " was " << int(bytes[i]) << ", is " << int(damaged[i]);
    EXPECT_TRUE(is_one_line(decoded.error().message)) << decoded.error().message;
  }
}

TEST(IvmFile, EveryTruncationAndAdditionIsRefused) {
  auto bytes = encode_ivm(small_volume());
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const auto decoded = decode_exact(std::span(bytes).first(n));
    ASSERT_FALSE(decoded) << "the first " << n << " bytes";
    EXPECT_TRUE(is_one_line(decoded.error().message)) << decoded.error().message;
  }
  for (std::size_t n : {1, 8, 4096}) {
    auto longer = bytes;
    longer.resize(bytes.size() + n);
    EXPECT_FALSE(decode_exact(longer)) << n << " bytes more";
  }
  bytes.insert(bytes.end(), bytes.begin(), bytes.end());
  EXPECT_FALSE(decode_exact(bytes));
}

// The version is the little-endian word after the 8 bytes of magic, now and in any version to come.
TEST(IvmFile, AnotherVersionIsRefusedByNameOfBoth) {
  auto bytes = encode_ivm(small_volume());
  for (const unsigned version : {1u, 4u, 6u, 77u}) {
    bytes[8] = std::byte(version);
    const auto decoded = decode_exact(bytes);
    ASSERT_FALSE(decoded);
    EXPECT_THAT(decoded.error().message, HasSubstr("version " + std::to_string(version)));
    EXPECT_THAT(decoded.error().message, HasSubstr("version " + std::to_string(kIvmVersion)));
    EXPECT_THAT(decoded.error().message, HasSubstr(version > kIvmVersion ? "use a newer program" : "build the file again"));
    EXPECT_TRUE(is_one_line(decoded.error().message));
  }
}

TEST(IvmFile, AFileOfTheOtherScopeIsRefused) {
  const TempDir folder;
  const auto one = folder / "one.ivm", every = folder / "every.ivm";
  ASSERT_TRUE(save_ivm(one, small_volume()));
  Volume volume = testing::digits({5, 4, 6}, 1);
  const auto format = choose_value_format(volume, {});
  ASSERT_TRUE(format);
  ASSERT_TRUE(save_values(every, build_value_volume(volume, *format)));
  EXPECT_FALSE(is_value_file(one));
  EXPECT_TRUE(is_value_file(every));
  const auto loaded = load_ivm(every);
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, HasSubstr("a data set of every range, not of one range"));
  const auto values = load_values(one);
  ASSERT_FALSE(values);
  EXPECT_THAT(values.error().message, HasSubstr("one range"));
  EXPECT_TRUE(load_ivm(one));
  EXPECT_TRUE(load_values(every));
}

// The bytes of a file with one more stream behind its others.
std::vector<std::byte> with_stream(std::vector<std::byte> bytes, std::uint32_t type, std::uint32_t flags, std::span<const std::byte> contents = {}) {
  constexpr std::size_t kHeader = 40, kEntry = 32;
  const auto add = [&bytes](std::size_t at, std::uint64_t more, std::size_t size) {
    std::uint64_t number = 0;
    std::memcpy(&number, &bytes[at], size);
    number += more;
    std::memcpy(&bytes[at], &number, size);
    return number;
  };
  const std::uint64_t streams = add(12, 1, 4) - 1;
  for (std::uint64_t i = 0; i < streams; ++i) add(kHeader + i * kEntry + 8, kEntry, 8);
  bytes.insert(bytes.begin() + std::ptrdiff_t(kHeader + streams * kEntry), kEntry, std::byte{});
  const std::size_t at = kHeader + streams * kEntry;
  add(at, type, 4);
  add(at + 4, flags, 4);
  add(at + 8, bytes.size(), 8);
  add(at + 16, contents.size(), 8);
  add(at + 24, XXH3_64bits(contents.data(), contents.size()), 8);
  add(16, kEntry + contents.size(), 8);
  std::memset(&bytes[32], 0, 8);
  add(32, XXH3_64bits(bytes.data(), at + kEntry), 8);
  bytes.insert(bytes.end(), contents.begin(), contents.end());
  return bytes;
}

TEST(IvmFile, StreamsThatAreUnknownAreSkippedOnlyIfTheySaySo) {
  const auto bytes = encode_ivm(small_volume());
  Volume volume = testing::digits({5, 4, 6}, 1);
  const auto every = encode_values(build_value_volume(volume, choose_value_format(volume, {}).value()));
  const std::vector<std::byte> contents(77, std::byte(5));
  const auto refusal_of = [](const std::vector<std::byte>& file) {
    const auto one = decode_exact(file);
    const auto values = decode_values(file, "every");
    EXPECT_FALSE(one && values);
    return one || values ? std::string() : one.error().message + values.error().message;
  };
  for (const auto& file : {bytes, every}) {
    EXPECT_EQ(refusal_of(with_stream(file, 40, 1, contents)), "");
    EXPECT_EQ(refusal_of(with_stream(file, 40, 1)), "");
    EXPECT_THAT(refusal_of(with_stream(file, 40, 0, contents)), HasSubstr("stream 40 is unknown; use a newer program"));
    auto damaged = with_stream(file, 40, 1, contents);
    damaged.back() ^= std::byte(1);
    EXPECT_THAT(refusal_of(damaged), HasSubstr("stream 40 is damaged (checksum)"));
    damaged.pop_back();
    EXPECT_THAT(refusal_of(damaged), HasSubstr("cut short"));
  }
  const auto refusal = [&](std::uint32_t type, std::uint32_t flags) { return refusal_of(with_stream(bytes, type, flags)); };
  EXPECT_THAT(refusal(40, 3), HasSubstr("damaged"));
  EXPECT_THAT(refusal(0, 0), HasSubstr("unknown"));
  EXPECT_THAT(refusal(std::uint32_t(StreamType::bricks), 0), HasSubstr("twice"));
  EXPECT_THAT(refusal(std::uint32_t(StreamType::histogram), 1), HasSubstr("does not belong"));
}

// The hash that the header has must be that of its table, even where their common checksum fits.
TEST(IvmFile, AContentHashOfOtherContentsIsRefused) {
  auto bytes = encode_ivm(small_volume());
  bytes[24] ^= std::byte(1);
  std::memset(&bytes[32], 0, 8);
  const std::uint64_t checksum = XXH3_64bits(bytes.data(), 40 + 32 * std::size_t(bytes[12]));
  std::memcpy(&bytes[32], &checksum, 8);
  const auto read = decode_exact(bytes);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("content hash"));
}

// Values are predicted from those of ancestors.
TEST(IvmFile, ASetWithoutAncestorsIsRefused) {
  const IntervalVolume sigma = small_volume();
  auto parts = testing::parts_of(sigma);
  std::vector<SupercubeKey> names;
  std::vector<std::uint64_t> occupancy;
  for (BrickIndex b{0}; b < sigma.set().bricks().size(); ++b) {
    sigma.set().for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      if (scale_of_key(key) != 0) return;
      names.push_back(key);
      occupancy.push_back(sigma.set().occupancy()[s]);
    });
  }
  parts.set = SupercubeSet(names, std::move(occupancy));
  parts.keys = ValueKeys(parts.set.size(), parts.description.format.last);
  parts.steps.resize(parts.set.size());
  parts.surface.to_distance.resize(parts.set.supercubes());
  parts.surface.slopes.resize(parts.set.size());
  const auto assembled = IntervalVolume::assemble(std::move(parts));
  ASSERT_TRUE(assembled);
  const auto decoded = decode_exact(encode_ivm(*assembled));
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message, HasSubstr("page 0 of 1 (scale 0, samples (0, 0, 0) to (8, 6, 5)) is damaged"));
}

// Pages are decoded in parallel where a scale has several.
TEST(IvmFile, ThreadsMakeNoDifference) {
  const IntervalVolume sigma = testing::build(testing::gyroid({90, 83, 80}), {.range = {-0.6, 0.9}, .refine = Refine::uniform});
  ASSERT_GT(sigma.size(), 2 * kPageValuesMost) << "or it has too few pages";
  const auto bytes = encode_ivm(sigma);
  EXPECT_EQ(encode_ivm(sigma, on_all_cores), bytes);
  const auto decoded = decode_ivm(bytes, "again", on_all_cores);
  ASSERT_TRUE(decoded) << decoded.error().message;
  EXPECT_TRUE(std::ranges::equal(decoded->keys().bytes(), sigma.keys().bytes()));
}

TEST(IvmFile, WhatIsNoIntervalVolumeIsRefusedInOneLineThatBeginsWithThePath) {
  const TempDir folder;
  const auto bytes = encode_ivm(small_volume());
  const std::string whole(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::filesystem::path paths[] = {folder.file("empty.ivm", ""),
                                         folder.path(),
                                         folder / "missing.ivm",
                                         folder / "no folder" / "missing.ivm",
                                         folder.file("text.ivm", "NRRD0004\ntype: float\n"),
                                         folder.file("long text.ivm", std::string(100000, 'x')),
                                         folder.file("cut.ivm", whole.substr(0, whole.size() / 2)),
                                         folder.file("magic.ivm", whole.substr(0, 8)),
                                         "/dev/null"};
  for (const auto& path : paths) {
    const auto loaded = load_ivm(path);
    ASSERT_FALSE(loaded) << path;
    EXPECT_THAT(loaded.error().message, StartsWith(path.string()));
    EXPECT_GT(loaded.error().message.size(), path.string().size() + 2) << "and says why";
    EXPECT_TRUE(is_one_line(loaded.error().message)) << loaded.error().message;
  }
}

TEST(IvmFile, FilesThatAreVastAndNoneOfTheseTakeNoMemory) {
  const TempDir folder;
  const auto bytes = encode_ivm(small_volume());
  for (const std::string& start : {std::string(), std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())}) {
    const auto path = folder.file("vast.ivm", start);
    std::filesystem::resize_file(path, std::uintmax_t(1) << 42);  // nothing but holes
    EXPECT_FALSE(load_ivm(path)) << "and throws nothing";
  }
}

TEST(IvmFile, AFileThatCannotBeWrittenIsAnErrorThatNamesIt) {
  const TempDir folder;
  const auto path = folder / "no folder" / "x.ivm";
  const auto saved = save_ivm(path, small_volume());
  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().message, HasSubstr("x.ivm"));
}

}  // namespace
}  // namespace intervale
