#include "common/ivm/ivm_file.h"
#include "common/ivm/verify.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>

#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kInf = std::numeric_limits<double>::infinity();

IntervalVolume small_volume() { return testing::build(testing::gyroid({9, 7, 6}), {.range = {-0.3, 0.4}}); }

// A copy in a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<IntervalVolume> decode_exact(std::span<const std::byte> bytes) {
  const auto exact = std::make_unique<std::byte[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  return decode_ivm({exact.get(), bytes.size()}, "damaged");
}

bool is_one_line(const std::string& message) { return !message.empty() && message.find('\n') == std::string::npos; }

void expect_equal(const IntervalVolume& a, const IntervalVolume& b) {
  Description described = b.description();
  described.name = a.description().name;
  EXPECT_EQ(a.description(), described);
  EXPECT_TRUE(std::ranges::equal(a.set().occupancy(), b.set().occupancy()));
  EXPECT_TRUE(std::ranges::equal(a.error_steps(), b.error_steps()));
  ASSERT_EQ(a.size(), b.size());
  a.set().for_each_down([&](const Place& p) {
    const auto q = b.set().find(a.set().centre(p));
    ASSERT_TRUE(q);
    const UpdateView u = a.update(p), v = b.update(*q);
    EXPECT_EQ(u.side_residual, v.side_residual);
    EXPECT_EQ(u.first_cuts, v.first_cuts);
    EXPECT_TRUE(std::ranges::equal(u.residuals, v.residuals));
    EXPECT_EQ(a.error(p.index), b.error(q->index));
  });
}

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
    volume.grid.spacing = {0.5, 1, 3};
    volume.grid.origin = {-4, 0, 7};
    const IntervalVolume sigma = testing::build(volume, {.range = c.range, .refine = c.refine});
    const auto path = folder / "first.second.ivm";
    ASSERT_TRUE(save_ivm(path, sigma));
    const auto loaded = load_ivm(path);
    ASSERT_TRUE(loaded) << loaded.error().message;
    EXPECT_EQ((*loaded)->description().name, "first.second");
    expect_equal(sigma, **loaded);
    const auto valid = validate(**loaded);
    EXPECT_TRUE(valid) << valid.error().message;
  }
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
  bytes[8] = std::byte{77};
  const auto decoded = decode_exact(bytes);
  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message, HasSubstr("77"));
  EXPECT_THAT(decoded.error().message, HasSubstr(std::to_string(kIvmVersion)));
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

TEST(Assemble, PartsThatFitMakeAnEqualVolume) {
  const IntervalVolume sigma = small_volume();
  const auto again = IntervalVolume::assemble(testing::parts_of(sigma));
  ASSERT_TRUE(again) << again.error().message;
  expect_equal(sigma, *again);
}

TEST(Assemble, PartsThatDoNotFitAreRefused) {
  using Parts = IntervalVolume::Parts;
  const IntervalVolume sigma = small_volume();
  ASSERT_GT(sigma.error_steps().size(), 3u);
  ASSERT_GT(sigma.description().root_patch.size(), 8u);
  const struct {
    const char* what;
    void (*spoil)(Parts&);
  } cases[] = {
      {"too few codes", [](Parts& p) { p.codes.pop_back(); }},
      {"too few error_to_distance codes", [](Parts& p) { p.error_to_distance.pop_back(); }},
      {"too many codes", [](Parts& p) { p.codes.emplace_back(); }},
      {"no codes", [](Parts& p) { p.codes.clear(); }},
      {"no set", [](Parts& p) { p.set = SupercubeSet(); }},
      {"a coefficient too few", [](Parts& p) { p.residuals.pop_back(); }},
      {"a coefficient too many", [](Parts& p) { p.residuals.push_back(0); }},
      {"a code that takes too many coefficients",
       [](Parts& p) {
         const UpdateCode most(std::uint16_t(31 << 2));
         p.residuals.resize(p.residuals.size() + most.coefficients() - p.codes[0].coefficients());
         p.codes[0] = most;
       }},
      {"a code of side 3", [](Parts& p) { p.codes[0] = UpdateCode(std::uint16_t(p.codes[0].bits() | 3)); }},
      {"a code of a level that is not there",
       [](Parts& p) { p.codes[0] = UpdateCode(std::uint16_t((p.codes[0].bits() & 127) | p.error_steps.size() << 7)); }},
      {"errors that descend", [](Parts& p) { std::swap(p.error_steps[0], p.error_steps[1]); }},
      {"a negative error", [](Parts& p) { p.error_steps[0] = -1; }},
      {"an infinite error", [](Parts& p) { p.error_steps.back() = std::numeric_limits<float>::infinity(); }},
      {"an error that is no number", [](Parts& p) { p.error_steps[1] = std::numeric_limits<float>::quiet_NaN(); }},
      {"no errors", [](Parts& p) { p.error_steps.clear(); }},
      {"too many errors", [](Parts& p) { p.error_steps.resize(kMaxErrorSteps + 1, p.error_steps.back()); }},
      {"a root patch too short", [](Parts& p) { p.description.root_patch.pop_back(); }},
      {"a root patch too long", [](Parts& p) { p.description.root_patch.push_back(0); }},
      {"no root patch", [](Parts& p) { p.description.root_patch.clear(); }},
      {"a root patch with a corner on no side", [](Parts& p) { p.description.root_patch[0] = 3; }},
      {"a side of 1 sample", [](Parts& p) { p.description.grid.dims[1] = 1; }},
      {"a negative side", [](Parts& p) { p.description.grid.dims[2] = -9; }},
      {"a side that is too long", [](Parts& p) { p.description.grid.dims[0] = kMaxSide + 1; }},
      {"no spacing", [](Parts& p) { p.description.grid.spacing[0] = 0; }},
      {"infinite spacing", [](Parts& p) { p.description.grid.spacing[0] = kInf; }},
      {"an origin that is no number", [](Parts& p) { p.description.grid.origin[2] = std::numeric_limits<double>::quiet_NaN(); }},
      {"a range upside down",
       [](Parts& p) {
         p.description.range = {1, 0};
       }},
      {"a range that is no number", [](Parts& p) { p.description.range.beta = std::numeric_limits<double>::quiet_NaN(); }},
  };
  for (const auto& c : cases) {
    Parts parts = testing::parts_of(sigma);
    c.spoil(parts);
    const auto assembled = IntervalVolume::assemble(std::move(parts));
    ASSERT_FALSE(assembled) << c.what;
    EXPECT_TRUE(is_one_line(assembled.error().message)) << c.what;
  }
}

// What assemble() cannot see, validate() does.
TEST(Assemble, PartsThatFitButMeanNothingAreNotValid) {
  const IntervalVolume sigma = small_volume();
  const auto refused = [&](auto spoil) {
    auto parts = testing::parts_of(sigma);
    spoil(parts);
    const auto assembled = IntervalVolume::assemble(std::move(parts));
    return !assembled || !validate(*assembled);
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& p) { ++p.description.full.tets; }));
  EXPECT_TRUE(refused([](auto& p) { --p.description.full.vertices; }));
  EXPECT_TRUE(refused([](auto& p) { p.description.grid.dims = {3, 2, 2}; })) << "updates outside the box";
  EXPECT_TRUE(refused([](auto& p) { p.codes[0] = UpdateCode(std::uint16_t(p.codes[0].bits() & 127)); }))
      << "the root's error is its descendants' least";
  for (UpdateIndex i{0}; i < sigma.size(); i += 7) {
    const unsigned turned = (sigma.codes()[i].side_residual() + 1) % 3;
    EXPECT_TRUE(refused([&](auto& p) { p.codes[i] = UpdateCode(std::uint16_t((p.codes[i].bits() & ~3) | turned)); })) << "side of update " << i;
  }
}

}  // namespace
}  // namespace intervale
