#include "common/ivm/value_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "common/ivm/value_page.h"
#include "common/ivm/value_verify.h"
#include "common/parallel/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"
#include "tests/support/temp_dir.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using Dims = std::array<std::int32_t, 3>;

ValueVolume build(const testing::ValueField& field) {
  Volume volume = field.volume;
  return build_value_volume(volume, field.format);
}

std::vector<std::byte> small_file() { return encode_values(build(testing::random_value_field({5, 4, 6}, 0))); }

TEST(AllDiamonds, AreThoseThatAnyRangeNeeds) {
  for (const Dims& dims : {Dims{2, 2, 2}, Dims{5, 5, 5}, Dims{9, 7, 5}, Dims{17, 12, 33}, Dims{2, 3, 40}, Dims{70, 3, 2}}) {
    const Volume volume = testing::digits(dims, 1);
    const FieldHierarchy hierarchy(volume, {{-kInf, kInf}, Refine::uniform});
    const SupercubeSet all = all_diamonds(Domain(dims));
    EXPECT_TRUE(std::ranges::equal(all.occupancy(), hierarchy.set().occupancy()));
    ASSERT_EQ(all.bricks().size(), hierarchy.set().bricks().size());
    for (BrickIndex b{0}; b < all.bricks().size(); ++b) EXPECT_EQ(all.bricks()[b].key, hierarchy.set().bricks()[b].key);
  }
}

TEST(AllDiamonds, AreCountedBySupercubesAndByBlocks) {
  std::mt19937 random(1);
  for (const Dims& dims : {Dims{2, 2, 2}, Dims{5, 5, 5}, Dims{9, 7, 5}, Dims{17, 12, 33}, Dims{2, 3, 40}, Dims{129, 3, 2}, Dims{130, 67, 66}}) {
    const Domain domain(dims);
    const SupercubeSet all = all_diamonds(domain);
    EXPECT_EQ(count_diamonds(domain), all.size());
    EXPECT_EQ(count_supercubes(domain), (SetCounts{all.bricks().size(), all.supercubes()}));
    for (int scale = 0; scale < domain.levels(); ++scale) {
      const Vertex last = last_supercube(domain, scale);
      const auto some = [&](std::int32_t most) { return std::int32_t(random() % unsigned(most + 1)); };
      const Vertex first{some(last.x), some(last.y), some(last.z)};
      std::uint64_t count = 0;
      for (Vertex p = first; p.z <= last.z; ++p.z) {
        for (p.y = first.y; p.y <= last.y; ++p.y)
          for (p.x = first.x; p.x <= last.x; ++p.x) count += std::uint64_t(std::popcount(updated_slots(domain, scale, p)));
      }
      EXPECT_EQ(count_diamonds(domain, scale, first, last), count);
    }
    std::vector<BlockSize> sizes;
    for (int scale = domain.levels() - 1; scale >= 0; --scale)
      for (const BlockSize& size : block_sizes(domain, scale)) sizes.push_back(size);
    const std::vector<BrickRun> blocks = blocks_of(all);
    ASSERT_EQ(sizes.size(), blocks.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      std::size_t diamonds = 0;
      for (BrickIndex b = blocks[i].first; b < blocks[i].end; ++b) diamonds += all.updates(b);
      EXPECT_EQ(sizes[i].diamonds, diamonds);
      EXPECT_EQ(sizes[i].scale, scale_of_key(all.bricks()[blocks[i].first].key));
    }
  }
}

TEST(ValueFile, GivesBackAllValues) {
  for (unsigned seed = 0; seed < 15; seed += 15 / testing::cases(15)) {  // the large box in any case
    const Dims boxes[] = {{9, 9, 9}, {9, 7, 5}, {17, 12, 33}, {2, 2, 2}, {70, 67, 66}};
    const testing::ValueField field = testing::random_value_field(boxes[seed / 5 == 2 ? 4 : seed % 4], seed);
    const ValueVolume volume = build(field);
    const std::vector<std::byte> bytes = encode_values(volume);
    EXPECT_EQ(bytes, encode_values(volume, on_all_cores));
    const auto decoded = decode_values(bytes, "again", on_all_cores);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(encode_values(*decoded), bytes);
    EXPECT_EQ(decoded->description().format, field.format);
    EXPECT_EQ(decoded->description().max_error, volume.description().max_error);
    EXPECT_EQ(decoded->description().statistics.histogram, volume.description().statistics.histogram);
    EXPECT_EQ(decoded->parts().error_levels, volume.parts().error_levels);
    EXPECT_TRUE(validate(*decoded));
    decoded->set().for_each_down([&](const Place& p) { ASSERT_EQ(field.format.value(decoded->key(p.index)), field.value(SupercubeSet::centre(p))); });
  }
}

TEST(ValueFile, RefusesEveryFlippedByteAndEveryTruncation) {
  const std::vector<std::byte> bytes = small_file();
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::byte> damaged = bytes;
    damaged[i] ^= std::byte(1 << i % 8);
    EXPECT_FALSE(decode_values(damaged, "damaged")) << "byte " << i;
    EXPECT_FALSE(decode_values(std::span(bytes).first(i), "short")) << i << " bytes";
  }
  std::vector<std::byte> longer = bytes;
  longer.emplace_back();
  EXPECT_FALSE(decode_values(longer, "long"));
}

// The bytes around a file's pages, as if those were not there.
struct AroundPages {
  explicit AroundPages(std::span<const std::byte> bytes) : pages(pages_beside_summary(bytes, bytes.size()).value().value()) {
    first.assign(bytes.begin(), bytes.begin() + std::ptrdiff_t(pages.offset));
    last.assign(bytes.begin() + std::ptrdiff_t(pages.offset + pages.bytes), bytes.end());
    file_bytes = bytes.size();
  }
  [[nodiscard]] FileEnds ends() const { return {first, last, file_bytes}; }
  StreamPlace pages;
  std::vector<std::byte> first, last;
  std::uint64_t file_bytes = 0;
};

TEST(ValueSummary, IsThatOfTheVolumeAndNeedsNoPages) {
  const TempDir folder;
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Dims boxes[] = {{9, 7, 5}, {2, 2, 2}, {2, 3, 40}, {70, 67, 66}};
    const std::vector<std::byte> bytes = encode_values(build(testing::random_value_field(boxes[seed % 4], seed)), on_all_cores);
    const ValueSummary expected = summary_of(decode_values(bytes, "scan").value(), bytes.size());
    const auto summary = decode_summary(AroundPages(bytes).ends(), "scan");
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(*summary, expected);
    EXPECT_EQ(decode_summary({bytes, {}, bytes.size()}, "scan").value(), expected);
    const auto file = folder.file("scan.ivm", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
    EXPECT_EQ(load_summary(file).value(), expected);
  }
}

TEST(ValueSummary, RefusesEveryFlippedByteButThoseOfPages) {
  std::vector<std::byte> bytes = small_file();
  AroundPages around(bytes);
  for (std::vector<std::byte>* part : {&around.first, &around.last}) {
    for (std::size_t i = 0; i < part->size(); ++i) {
      (*part)[i] ^= std::byte(1 << i % 8);
      EXPECT_FALSE(decode_summary(around.ends(), "damaged")) << "byte " << i;
      (*part)[i] ^= std::byte(1 << i % 8);
    }
    EXPECT_TRUE(decode_summary(around.ends(), "whole"));
    const std::byte last = part->back();
    part->pop_back();
    EXPECT_FALSE(decode_summary(around.ends(), "short"));
    part->push_back(last);
  }
  const TempDir folder;
  EXPECT_THAT(load_summary(folder.path() / "none.ivm").error().message, HasSubstr("none.ivm: No such file"));
  EXPECT_THAT(load_summary(folder.path()).error().message, HasSubstr("is a folder"));
  EXPECT_THAT(load_summary(folder.file("text.ivm", "no data set")).error().message, HasSubstr("text.ivm: not an interval volume file"));
}

TEST(ValueFile, SaysWhichVersionItReads) {
  const TempDir folder;
  std::vector<std::byte> bytes = small_file();
  const auto file = folder.file("values.ivm", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  EXPECT_TRUE(is_value_file(file));
  bytes[8] = std::byte(6);
  const auto newer = decode_values(bytes, "newer");
  ASSERT_FALSE(newer);
  EXPECT_THAT(newer.error().message, HasSubstr("use a newer program"));
  bytes[8] = std::byte(4);
  EXPECT_FALSE(is_value_file(folder.file("older.ivm", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()))));
  EXPECT_FALSE(is_value_file(folder.file("text.ivm", "no data set")));
}

TEST(ValuePage, DamagedPagesAreRefusedOrDecoded) {
  const testing::ValueField field = testing::random_value_field({17, 12, 33}, 0);
  const ValueVolume volume = build(field);
  ValueVolume::Parts parts = volume.parts();
  const auto pages = pages_of(parts.set);
  ASSERT_EQ(pages.size(), 1u);
  const std::vector<std::uint8_t> bytes = encode_page(parts, pages[0]);
  std::mt19937 random(1);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::uint8_t> damaged = bytes;
    damaged.resize(random() % 4 == 0 ? random() % bytes.size() : bytes.size());
    for (int k = 0; k < 3 && !damaged.empty(); ++k) damaged[random() % damaged.size()] ^= std::uint8_t(1u << random() % 8);
    (void)decode_page(parts, pages[0], damaged);
  }
  EXPECT_TRUE(decode_page(parts, pages[0], bytes));
}

TEST(ErrorLevels, AreTheLeastThatAreNoSmaller) {
  for (const double largest : {1.0, 3.0, 1e-9, 7e30}) {
    EXPECT_EQ(ValueVolume::level_of_error(largest, 0), 0);
    EXPECT_EQ(ValueVolume::error_of_level(largest, kErrorLevels - 1), largest);
    for (int i = 0; i <= 1000; ++i) {
      const double error = std::min(largest, largest * i / 1000);
      const ErrorLevel level = ValueVolume::level_of_error(largest, error);
      EXPECT_GE(ValueVolume::error_of_level(largest, level), error);
      EXPECT_TRUE(level <= 1 || ValueVolume::error_of_level(largest, ErrorLevel(level - 1)) < error);
    }
  }
}

TEST(FitWeights, DoesNotDependOnThreads) {
  const ValueVolume volume = build(testing::random_value_field({70, 67, 66}, 0));
  EXPECT_EQ(fit_weights(volume.parts()), fit_weights(volume.parts(), on_all_cores));
}

}  // namespace
}  // namespace intervale
