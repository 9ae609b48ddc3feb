#include "server/resume/build_checkpoint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/value_file.h"
#include "server/builder/channel_builder.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/seeds.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::IsEmpty;

constexpr std::array<std::int32_t, 3> kBox{9, 7, 6};

ValueVolume::Parts parts_of_every_range(std::optional<double> step = {}) {
  Volume volume = testing::gyroid(kBox);
  volume.name = {};
  volume.labels = {"mm", "density", "g", "RAS"};
  return build_value_volume(volume, choose_value_format(volume, step).value(), {}).take();
}

IntervalVolume::Parts parts_of_one_range() {
  Volume volume = testing::gyroid(kBox);
  volume.name = {};
  const auto format = choose_value_format(volume, {}).value();
  round_samples(volume, format);
  return FieldHierarchy(volume, {{-0.3, 0.2}, Refine::uniform, {}}).parts(format, false).value();
}

std::vector<std::byte> file_of(IntervalVolume::Parts parts) { return encode_ivm(IntervalVolume::assemble(std::move(parts)).value()); }
std::vector<std::byte> file_of(ValueVolume::Parts parts) { return encode_values(ValueVolume(std::move(parts))); }

struct CheckpointTest : ::testing::Test {
  TempDir folder;
  std::filesystem::path path = folder / "out.ivm.resume";
  std::vector<std::string> warnings;
  ValueVolume::Parts every = parts_of_every_range();
  IntervalVolume::Parts one = parts_of_one_range();
  BuiltChannel channel = build_channel(testing::digits(kBox, 3), "digits", {}, every.set).value();
  std::vector<std::byte> file_of_every = file_of(every), file_of_one = file_of(one);

  Result<std::unique_ptr<BuildCheckpoint>> try_open() {
    return BuildCheckpoint::open(path, 1, [this](const std::string& what) { warnings.push_back(what); });
  }
  std::unique_ptr<BuildCheckpoint> open() {
    auto checkpoint = try_open();
    EXPECT_TRUE(checkpoint) << checkpoint.error().message;
    return std::move(*checkpoint);
  }
  void keep_all() {
    const auto checkpoint = open();
    checkpoint->keep_every_range(every);
    checkpoint->keep_one_range(one, "-1.5 to 1.5");
    checkpoint->keep_channel(0, channel.channel, channel.keys);
    (void)encode_values(ValueVolume(every), serial, checkpoint.get());
  }
  // Whatever is there is what was kept. How many things are there.
  std::size_t count_good(BuildCheckpoint& checkpoint) {
    std::size_t good = 0;
    if (auto kept = checkpoint.take_every_range()) {
      EXPECT_EQ(kept->description, every.description);
      EXPECT_EQ(file_of(std::move(*kept)), file_of_every);
      ++good;
    }
    if (auto kept = checkpoint.take_one_range()) {
      EXPECT_EQ(kept->parts.description, one.description);
      EXPECT_EQ(kept->values, "-1.5 to 1.5");
      EXPECT_EQ(file_of(std::move(kept->parts)), file_of_one);
      ++good;
    }
    if (const auto kept = checkpoint.take_channel(0, every.set)) {
      EXPECT_EQ(kept->channel, channel.channel);
      EXPECT_EQ(std::vector(kept->keys[0].bytes().begin(), kept->keys[0].bytes().end()),
                std::vector(channel.keys[0].bytes().begin(), channel.keys[0].bytes().end()));
      ++good;
    }
    good += checkpoint.find({0, 0}).has_value();
    EXPECT_EQ(encode_values(ValueVolume(every), serial, &checkpoint), file_of_every);
    return good;
  }
};

TEST_F(CheckpointTest, GivesBackWhatWasKept) {
  keep_all();
  const auto checkpoint = open();
  EXPECT_EQ(checkpoint->pages(), 1);
  EXPECT_EQ(count_good(*checkpoint), 4);
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(CheckpointTest, KeepsATableOfValues) {
  std::vector<double> samples(std::size_t(kBox[0] * kBox[1] * kBox[2]));
  for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = std::exp(10.0 * double(i % 7));
  Volume volume = testing::volume_of_type(SampleType::f64, kBox, samples);
  every = build_value_volume(volume, choose_value_format(volume, 0.0).value(), {}).take();
  ASSERT_TRUE(every.description.format.table);
  every.description.name = {};
  open()->keep_every_range(every);
  const auto kept = open()->take_every_range();
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->description, every.description);
}

TEST_F(CheckpointTest, PagesOfTheFieldAndOfChannelsDiffer) {
  every.description.channels = {channel.channel};
  every.channel_keys = {channel.keys};
  const auto expected = file_of(every);
  for (int time = 0; time < 2; ++time) {
    const auto checkpoint = open();
    EXPECT_EQ(encode_values(ValueVolume(every), serial, checkpoint.get()), expected);
    EXPECT_EQ(checkpoint->pages(), 2);
  }
}

TEST_F(CheckpointTest, ErrorsOfScalesAreThereUntilTheValuesAre) {
  Volume volume = testing::gyroid({33, 20, 17});
  const auto hierarchy = [&volume](BuildCheckpoint* kept) { return FieldHierarchy(volume, {{-0.3, 0.2}, Refine::boundary, {}, kept}); };
  const auto expected = encode_ivm(hierarchy(nullptr).compact().value());
  std::size_t scales = 0;
  {
    const auto checkpoint = open();
    EXPECT_EQ(encode_ivm(hierarchy(checkpoint.get()).compact().value()), expected);
    scales = checkpoint->error_scales();
    EXPECT_EQ(int(scales), Domain(volume.grid.dims).levels());
  }
  std::string bytes = contents_of(path);
  {
    const auto checkpoint = open();
    EXPECT_EQ(encode_ivm(hierarchy(checkpoint.get()).compact().value()), expected);
    EXPECT_EQ(checkpoint->error_scales(), scales);
    EXPECT_THAT(warnings, IsEmpty());
    checkpoint->keep_one_range(one, {});
    EXPECT_EQ(checkpoint->error_scales(), 0);
  }
  bytes[1000] ^= 1;
  folder.file("out.ivm.resume", bytes);
  EXPECT_EQ(encode_ivm(hierarchy(open().get()).compact().value()), expected);
  EXPECT_EQ(warnings.size(), 1);
}

TEST_F(CheckpointTest, EveryTruncationLeavesWhatIsWhole) {
  keep_all();
  const std::string whole = contents_of(path);
  const std::size_t step = whole.size() / 500 + 1;
  for (std::size_t bytes = 0; bytes < whole.size(); bytes += step) {
    folder.file("out.ivm.resume", whole.substr(0, bytes));
    EXPECT_LT(count_good(*open()), 4) << bytes;
  }
  EXPECT_THAT(warnings, IsEmpty());
}

TEST_F(CheckpointTest, FlippedBytesAreDroppedOrRefused) {
  keep_all();
  const std::string whole = contents_of(path);
  const std::size_t step = whole.size() / testing::cases(300) + 1;
  for (std::size_t at = 0; at < whole.size(); at += at < testing::cases(200) ? 1 : step) {
    std::string damaged = whole;
    damaged[at] = char(damaged[at] ^ (1 << at % 8));
    folder.file("out.ivm.resume", damaged);
    warnings.clear();
    const auto checkpoint = try_open();
    if (!checkpoint) {
      EXPECT_LT(at, 8);
      continue;
    }
    EXPECT_LT(count_good(**checkpoint), 4) << at;
    EXPECT_EQ(warnings.size(), 1) << at;
  }
}

// Records with right checksums that no build wrote: nothing that they say is believed before it is checked.
TEST_F(CheckpointTest, ContentsThatLieAreTakenOrDroppedButDoNoHarm) {
  keep_all();
  const auto journal = BuildJournal::open(path, 1, [](const std::string&) {}).value();
  for (const std::uint32_t kind : {1u, 2u, 3u}) {
    BuildJournal::Reader reader(*journal, {kind});
    std::vector<std::byte> contents(reader.left());
    ASSERT_TRUE(reader.read(contents));
    ASSERT_TRUE(reader.is_intact());
    const std::size_t step = contents.size() / 400 + 1;
    for (std::size_t at = 0; at < contents.size(); at += at < 200 ? 1 : step) {
      auto lie = contents;
      lie[at] ^= std::byte(at % 2 == 0 ? 0xff : 0x40);
      const auto liar = folder / "liar";
      std::filesystem::remove(liar);
      BuildJournal::open(liar, 1, [](const std::string&) {}).value()->append({kind}, lie);
      const auto checkpoint = BuildCheckpoint::open(liar, 1, [](const std::string&) {}).value();
      if (auto kept = checkpoint->take_every_range()) {
        EXPECT_EQ(kept->keys.size(), kept->set.size());
      }
      if (auto kept = checkpoint->take_one_range()) (void)IntervalVolume::assemble(std::move(kept->parts));
      (void)checkpoint->take_channel(0, every.set);
    }
  }
}

}  // namespace
}  // namespace intervale
