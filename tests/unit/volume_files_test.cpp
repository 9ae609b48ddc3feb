// Every format that volumes are read from, by the same laws.
#include "tests/support/volume_files.h"
#include "common/patch/visit_samples.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "common/patch/description.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "server/volume/volume_reader.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using testing::VolumeFile;

class VolumeFiles : public ::testing::TestWithParam<std::size_t> {
 protected:
  [[nodiscard]] const VolumeFile& file() const { return testing::volume_files()[GetParam()]; }
  [[nodiscard]] Result<Volume> read(const std::string& bytes, std::optional<std::uint64_t> time_point) const {
    return read_volume(folder_.file(file().name, bytes), {}, time_point);
  }
  const TempDir folder_;
};

void expect_samples(const Volume& volume) {
  EXPECT_EQ(volume.grid.dims, testing::kFileDims);
  EXPECT_EQ(volume.components, 1u);
  visit_samples(volume, [](auto samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) EXPECT_EQ(double(samples[i]), testing::sample_in_file(i)) << i;
  });
}

// A failure has one line, and what is read is of one piece.
void expect_sound(const Result<Volume>& volume) {
  if (!volume) {
    EXPECT_FALSE(volume.error().message.empty());
    EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
    return;
  }
  EXPECT_EQ(volume->bytes.size(), volume->grid.sample_count() * volume->components * size_of(volume->type));
  EXPECT_TRUE(check_grid(volume->grid));
}

// Two boxes with slices between them that nobody reads.
TEST_P(VolumeFiles, AreReadInBoxes) {
  const auto reader = open_volume(folder_.file(file().name, file().bytes), {}, file().time_point);
  ASSERT_TRUE(reader) << reader.error().message;
  BoxReader boxes(**reader);
  for (const SampleBox& box : {SampleBox{{1, 0, 0}, {2, 1, 0}}, SampleBox{{0, 1, 2}, {2, 1, 3}}}) {
    Volume part{"", {}, (*reader)->header().type, {}};
    const auto read = boxes.read(box, part.bytes);
    ASSERT_TRUE(read) << read.error().message;
    rescale(part, (*reader)->header().slope, (*reader)->header().intercept);
    std::vector<double> expected, found;
    for (std::int64_t z = box.first[2]; z <= box.last[2]; ++z)
      for (std::int64_t y = box.first[1]; y <= box.last[1]; ++y)
        for (std::int64_t x = box.first[0]; x <= box.last[0]; ++x) expected.push_back(testing::sample_in_file(std::size_t((z * 2 + y) * 3 + x)));
    visit_samples(part, [&](auto samples) { found.assign(samples.begin(), samples.end()); });
    EXPECT_EQ(found, expected);
  }
}

TEST_P(VolumeFiles, AreReadAsTheyWereMade) {
  const auto path = folder_.file(file().name, file().bytes);
  const auto header = read_volume_header(path);
  ASSERT_TRUE(header) << header.error().message;
  ASSERT_TRUE(*header);
  EXPECT_EQ((*header)->labels.space, file().space);
  EXPECT_EQ((*header)->time_points, file().time_points);
  const auto volume = read_volume(path, {}, file().time_point);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->type, file().type);
  for (std::size_t k = 0; k < 12; ++k) EXPECT_NEAR(volume->grid.affine.rows[k], file().affine.rows[k], 1e-12) << k;
  expect_samples(*volume);
}

TEST_P(VolumeFiles, AreKnownByWhatTheyBeginWith) {
  const auto volume = read_volume(folder_.file("something", file().bytes), {}, file().time_point);
  ASSERT_TRUE(volume) << volume.error().message;
  expect_samples(*volume);
}

TEST_P(VolumeFiles, TakeNoLayout) {
  const auto volume = read_volume(folder_.file("something", file().bytes), RawLayout{{2, 2, 2}, SampleType::u8}, {});
  ASSERT_FALSE(volume);
  EXPECT_TRUE(volume.error().usage);
}

TEST_P(VolumeFiles, NeedATimePointIfTheyHaveSeveral) {
  const auto volume = read(file().bytes, {});
  ASSERT_EQ(volume.has_value(), file().time_points == 1);
  EXPECT_TRUE(volume || volume.error().usage);
  const auto beyond = read(file().bytes, file().time_points);
  ASSERT_FALSE(beyond);
  EXPECT_TRUE(beyond.error().usage);
}

TEST_P(VolumeFiles, AreRefusedIfTheyAreCutShort) {
  const std::size_t end = file().after.empty() ? file().bytes.size() : file().bytes.rfind(file().after);
  for (std::size_t size = 0; size < file().bytes.size(); ++size) {
    const auto volume = read(file().bytes.substr(0, size), file().time_point);
    expect_sound(volume);
    // The last number of a text may lose digits, and a compressed file's end is not looked for.
    if (volume && size + 8 < end) ADD_FAILURE() << file().name << " of " << size << " bytes is read";
  }
}

TEST_P(VolumeFiles, CanHoldAnyBytes) {
  std::mt19937 random(GetParam());
  for (int run = 0; run < 250; ++run) {
    std::string bytes = file().bytes;
    for (unsigned k = 0; k <= random() % 3; ++k) bytes[random() % std::min<std::size_t>(bytes.size(), 600)] = char(random());
    expect_sound(read(bytes, file().time_point));
  }
}

// Some chunks of a decoder lie behind the box.
TEST(CodedVolumes, MayEndWithSamplesThatNobodyReads) {
  const TempDir folder;
  const std::string samples(std::size_t(300) * 300 * 2, 'x');
  const std::string header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 300 300 2\nencoding: ";
  for (const std::string& file :
       {header + "gzip\n\n" + testing::deflated(samples, testing::Wrapping::gzip), header + "bzip2\n\n" + testing::bzip2(samples)}) {
    const auto volume = read_volume(folder.file("a.nrrd", file), {}, {}, {}, SampleBox{{0, 3, 0}, {9, 9, 1}});
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(volume->bytes, std::vector<std::byte>(10 * 7 * 2, std::byte('x')));
  }
}

INSTANTIATE_TEST_SUITE_P(All, VolumeFiles, ::testing::Range<std::size_t>(0, testing::volume_files().size()), [](const auto& file) {
  std::string name = testing::volume_files()[file.param].name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

Volume numbers(std::vector<std::int16_t> stored) {
  Volume volume{"v", {{int(stored.size()), 1, 1}, {}}, SampleType::i16, {}};
  volume.bytes.resize(2 * stored.size());
  std::copy(stored.begin(), stored.end(), reinterpret_cast<std::int16_t*>(volume.bytes.data()));
  return volume;
}

TEST(Rescale, WholeNumbersStayWhole) {
  Volume volume = numbers({0, 1000, 4095});
  rescale(volume, 1, -1024);
  EXPECT_EQ(volume.type, SampleType::i16);
  visit_samples(volume, [](auto samples) {
    EXPECT_EQ(samples[0], -1024);
    EXPECT_EQ(samples[2], 3071);
  });
  rescale(volume, 1000, 0);
  EXPECT_EQ(volume.type, SampleType::i32);
  visit_samples(volume, [](auto samples) { EXPECT_EQ(samples[2], 3071000); });
}

TEST(Rescale, OthersBecomeFloats) {
  Volume volume = numbers({-2, 0, 3});
  rescale(volume, 0.5, 0.25);
  EXPECT_EQ(volume.type, SampleType::f32);
  visit_samples(volume, [](auto samples) {
    EXPECT_EQ(samples[0], -0.75);
    EXPECT_EQ(samples[2], 1.75);
  });
}

TEST(VolumeFileNames, OfAKnownFormatNeedItsContents) {
  const TempDir folder;
  for (const char* name : {"v.nii", "v.hdr", "v.mha", "v.mhd", "v.mrc", "v.npy", "v.vtk", "v.vti", "v.NRRD"}) {
    const auto volume = read_volume(folder.file(name, "x"), {});
    ASSERT_FALSE(volume) << name;
    EXPECT_FALSE(volume.error().usage) << name;
    EXPECT_NE(volume.error().message.find(name), std::string::npos) << volume.error().message;
  }
}

// As VTK writes scalars of unsigned bytes.
TEST(LegacyVtk, BytesAreColors) {
  const TempDir folder;
  const std::string before = "# vtk DataFile Version 5.1\nvtk output\n";
  const std::string after = "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 4\nSPACING 1 1 1\nORIGIN 0 0 0\nPOINT_DATA 24\nCOLOR_SCALARS density 1\n";
  const std::string samples = "abcdefghijklmnopqrstuvwx";
  const auto volume = read_volume(folder.file("v.vtk", before + "BINARY" + after + samples + "\n"), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->type, SampleType::u8);
  EXPECT_EQ(volume->labels.field, "density");
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(volume->bytes.data()), volume->bytes.size()), samples);
  const auto text = read_volume(folder.file("t.vtk", before + "ASCII" + after + "0.1 0.2"), {});
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().message.find("BINARY"), std::string::npos);
}

TEST(VolumeFileNames, DetachedDataIsFoundBesideItsHeader) {
  const TempDir folder;
  const auto& plain = testing::volume_files()[0].bytes;
  std::string header = plain.substr(0, 348);
  header.replace(344, 3, "ni1");
  header.replace(108, 4, std::string(4, '\0'));
  const auto path = folder.file("pair.hdr", header);
  folder.file("pair.img", plain.substr(352));
  const auto volume = read_volume(path, {});
  ASSERT_TRUE(volume) << volume.error().message;
  expect_samples(*volume);
}

}  // namespace
}  // namespace intervale
