#include "server/volume/raw_reader.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "common/patch/visit_samples.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

template <class T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

TEST(RawReader, ReadsEveryTypeXFastest) {
  const TempDir folder;
  const auto read = [&]<class T>(SampleType type, T) {
    std::vector<T> samples(24);
    for (int i = 0; i < 24; ++i) samples[i] = static_cast<T>(i * 5 - 7);
    const auto path = folder.file("v.raw", bytes_of(samples));
    const auto volume = read_volume(path, RawLayout{{2, 3, 4}, type, false, 0, Affine::of({1, 2, 3}, {4, 5, 6})});
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->name, "v");
    EXPECT_EQ(volume->type, type);
    EXPECT_EQ(volume->grid, (Grid{{2, 3, 4}, Affine::of({1, 2, 3}, {4, 5, 6})}));
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(volume->bytes.data()), volume->bytes.size()), bytes_of(samples));
  };
  read(SampleType::u8, std::uint8_t{});
  read(SampleType::i8, std::int8_t{});
  read(SampleType::u16, std::uint16_t{});
  read(SampleType::i16, std::int16_t{});
  read(SampleType::u32, std::uint32_t{});
  read(SampleType::i32, std::int32_t{});
  read(SampleType::f32, float{});
  read(SampleType::f64, double{});
}

TEST(RawReader, SkipsAndSwaps) {
  const TempDir folder;
  std::string file = "header!";
  for (int i = 0; i < 8; ++i) file += {'\x01', static_cast<char>(i)};
  const auto volume = read_volume(folder.file("v.raw", file), RawLayout{{2, 2, 2}, SampleType::u16, true, 7});
  ASSERT_TRUE(volume) << volume.error().message;
  visit_samples(*volume, [](auto samples) {
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(static_cast<int>(samples[i]), 256 + int(i));
  });
}

TEST(RawReader, RefusesAFileTooShortOrTooLongWithBothNumbers) {
  const TempDir folder;
  for (const std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{9}}) {
    const auto volume = read_volume(folder.file("v.raw", std::string(size, 'x')), RawLayout{{2, 2, 2}, SampleType::u8});
    ASSERT_FALSE(volume);
    EXPECT_FALSE(volume.error().usage);
    EXPECT_NE(volume.error().message.find(std::to_string(size) + " bytes"), std::string::npos) << volume.error().message;
    EXPECT_NE(volume.error().message.find("take 8"), std::string::npos) << volume.error().message;
    EXPECT_NE(volume.error().message.find(size < 8 ? "too short" : "too long"), std::string::npos) << volume.error().message;
  }
}

TEST(RawReader, RefusesLayoutsThatCannotBe) {
  const TempDir folder;
  const auto path = folder.file("v.raw", std::string(8, 'x'));
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  const std::vector<RawLayout> layouts{
      {{1, 2, 4}, SampleType::u8},
      {{0, 2, 4}, SampleType::u8},
      {{-2, -2, 2}, SampleType::u8},
      {{2, 2, (1 << 20) + 1}, SampleType::u8},
      {{std::numeric_limits<std::int64_t>::max(), 2, 2}, SampleType::u8},
      {{2, 2, 2}, SampleType::u8, false, std::numeric_limits<std::uint64_t>::max()},
      {{2, 2, 2}, SampleType::u8, false, 0, Affine::of({0, 1, 1})},
      {{2, 2, 2}, SampleType::u8, false, 0, Affine{{1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0}}},
      {{2, 2, 2}, SampleType::u8, false, 0, Affine::of({1, 1, nan})},
      {{2, 2, 2}, SampleType::u8, false, 0, Affine::of({1, 1, 1}, {infinity, 0, 0})},
      {{2, 2, 2}, SampleType::u8, false, 0, Affine::of({1e308, 1, 1}, {1e308, 0, 0})},
  };
  for (const auto& layout : layouts) {
    const auto volume = read_volume(path, layout);
    ASSERT_FALSE(volume);
    EXPECT_TRUE(volume.error().usage) << volume.error().message;
  }
}

TEST(RawReader, AHugeLayoutAllocatesNothing) {
  const TempDir folder;
  const auto volume = read_volume(folder.file("v.raw", "x"), RawLayout{{1 << 20, 1 << 20, 1 << 20}, SampleType::f64});
  ASSERT_FALSE(volume);
  EXPECT_NE(volume.error().message.find("9223372036854775808"), std::string::npos) << volume.error().message;
}

TEST(RawReader, RefusesWhatIsNoRegularFile) {
  const TempDir folder;
  ASSERT_EQ(::mkfifo((folder / "pipe").c_str(), 0600), 0);
  for (const auto& path : {folder.path(), folder / "none", folder / "pipe", std::filesystem::path("/dev/zero")}) {
    const auto volume = read_volume(path, RawLayout{{2, 2, 2}, SampleType::u8});
    ASSERT_FALSE(volume) << path;
    EXPECT_NE(volume.error().message.find(path.string()), std::string::npos) << volume.error().message;
  }
}

TEST(RawReader, ParsesTypeNames) {
  for (const char* name : {"u8", "i8", "u16", "i16", "u32", "i32", "f32", "f64"}) {
    const auto type = parse_sample_type(name);
    ASSERT_TRUE(type);
    EXPECT_STREQ(name_of(*type), name);
  }
  for (const char* name : {"", "u64", "float", "U8", "u8 "}) {
    const auto type = parse_sample_type(name);
    ASSERT_FALSE(type);
    EXPECT_TRUE(type.error().usage);
  }
}

TEST(ReadVolume, WantsALayoutForRawOnly) {
  const TempDir folder;
  const auto raw = read_volume(folder.file("v.dat", std::string(8, 'x')), std::nullopt);
  ASSERT_FALSE(raw);
  EXPECT_TRUE(raw.error().usage);
  EXPECT_NE(raw.error().message.find("--dims"), std::string::npos);
  EXPECT_NE(raw.error().message.find("--type"), std::string::npos);
  EXPECT_TRUE(read_volume(folder / "v.dat", RawLayout{{2, 2, 2}, SampleType::u8}));
  const auto nrrd = read_volume(folder.file("v.NRRD", "x"), RawLayout{{2, 2, 2}, SampleType::u8});
  ASSERT_FALSE(nrrd);
  EXPECT_TRUE(nrrd.error().usage);
}

template <class Float>
Volume floats(SampleType type, Float bad) {
  std::vector<Float> samples(2 * 3 * 4, Float{1});
  samples[1 + 2 * (2 + 3 * 3)] = bad;  // the last but one in x, y, z: (1, 2, 3)
  Volume volume{"v", {{2, 3, 4}, {}}, type, std::vector<std::byte>(samples.size() * sizeof(Float))};
  std::memcpy(volume.bytes.data(), samples.data(), volume.bytes.size());
  return volume;
}

TEST(CheckFinite, NamesTheFirstBadSample) {
  auto with_nan = floats(SampleType::f32, std::nanf(""));
  const auto checked = check_finite(with_nan, std::nullopt);
  ASSERT_FALSE(checked);
  EXPECT_EQ(checked.error().message, "sample (1, 2, 3) of 'v' is NaN; give such samples a value with --nan VALUE");
  auto with_infinity = floats(SampleType::f64, -std::numeric_limits<double>::infinity());
  EXPECT_FALSE(check_finite(with_infinity, std::nullopt));
  auto good = floats(SampleType::f64, 2.0);
  EXPECT_TRUE(check_finite(good, std::nullopt));
}

TEST(CheckFinite, ReplacesEveryBadSample) {
  auto volume = floats(SampleType::f32, std::numeric_limits<float>::infinity());
  ASSERT_TRUE(check_finite(volume, -3.5));
  EXPECT_EQ(volume.bytes, floats(SampleType::f32, -3.5F).bytes);
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity(), 1e300}) {
    const auto checked = check_finite(volume, bad);
    ASSERT_FALSE(checked);
    EXPECT_TRUE(checked.error().usage);
  }
}

}  // namespace
}  // namespace intervale
