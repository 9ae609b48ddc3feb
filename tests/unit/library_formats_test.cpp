// TIFF and DICOM, which programs of their own read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/header_line.h"
#include "server/volume/library_formats.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "tests/support/library_files.h"
#include "tests/support/seeds.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using testing::DicomImage;

class LibraryFormats : public ::testing::Test {
 protected:
  // A library that is not there leaves its program out.
  static void need(const char* program) {
    if (!std::filesystem::exists(std::filesystem::read_symlink("/proc/self/exe").parent_path() / program)) GTEST_SKIP() << "no " << program;
  }
  [[nodiscard]] std::filesystem::path scan(const std::vector<DicomImage>& images, const std::string& folder = "scan") const {
    std::filesystem::create_directory(folder_ / folder);
    for (std::size_t k = 0; k < images.size(); ++k) static_cast<void>(folder_.file(folder + "/" + std::to_string(k), dicom_file(images[k])));
    return folder_ / folder;
  }
  const TempDir folder_;
};
class Tiff : public LibraryFormats {
  void SetUp() override { need("read-tiff"); }
};
class Dicom : public LibraryFormats {
  void SetUp() override { need("read-dicom"); }
};

std::vector<double> samples_of(const Volume& volume) {
  return visit_samples(volume, [](auto samples) { return std::vector<double>(samples.begin(), samples.end()); });
}

void expect_failure(const Result<Volume>& volume, const std::string& part, bool usage = false) {
  ASSERT_FALSE(volume) << part;
  EXPECT_NE(volume.error().message.find(part), std::string::npos) << volume.error().message;
  EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
  EXPECT_EQ(volume.error().usage, usage) << volume.error().message;
}

std::vector<std::vector<std::uint16_t>> pages(std::size_t count) {  // of 3 x 2: the first number is ten times the page's
  std::vector<std::vector<std::uint16_t>> all;
  for (std::size_t k = 0; k < count; ++k) {
    all.emplace_back();
    for (std::size_t i = 0; i < 6; ++i) all.back().push_back(std::uint16_t(10 * k + i));
  }
  return all;
}

TEST_F(Tiff, PagesAreSlices) {
  const auto volume = read_volume(folder_.file("v", testing::tiff_file(3, 2, pages(4))), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{3, 2, 4}));
  EXPECT_EQ(volume->type, SampleType::u16);
  EXPECT_EQ(volume->name, "v");
  for (std::size_t k = 0; k < 4; ++k) EXPECT_EQ(samples_of(*volume)[6 * k + 5], double(10 * k + 5));
}

TEST_F(Tiff, FilesOfAFolderAreSlicesInTheOrderOfTheirNumbers) {
  std::filesystem::create_directory(folder_ / "stack");
  for (std::size_t k = 0; k < 12; ++k) folder_.file("stack/s_" + std::to_string(k) + ".tif", testing::tiff_file(3, 2, {pages(12)[k]}));
  folder_.file("stack/notes.txt", "by hand");
  const auto volume = read_volume(folder_ / "stack/", {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims[2], 12);
  EXPECT_EQ(volume->name, "stack");
  for (std::size_t k = 0; k < 12; ++k) EXPECT_EQ(samples_of(*volume)[6 * k], double(10 * k));
  folder_.file("stack/s_5.tif", testing::tiff_file(2, 3, {pages(1)[0]}));
  expect_failure(read_volume(folder_ / "stack", {}), "page 6 differs from the first");
  folder_.file("stack/s_5.tif", testing::tiff_file(3, 2, pages(2)));
  expect_failure(read_volume(folder_ / "stack", {}), "several pages");
}

TEST_F(Tiff, OmeSaysDistancesChannelsAndTimes) {
  const std::string ome =
      "<?xml version=\"1.0\"?><OME xmlns=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><Image ID=\"Image:0\"><Pixels "
      "DimensionOrder=\"XYCZT\" "
      "SizeX=\"3\" SizeY=\"2\" SizeZ=\"2\" SizeC=\"2\" SizeT=\"3\" PhysicalSizeX=\"0.5\" PhysicalSizeY=\"0.25\" PhysicalSizeZ=\"2\"/></Image></OME>";
  const auto path = folder_.file("v.ome.tif", testing::tiff_file(3, 2, pages(12), ome));
  const auto header = read_volume_header(path);
  ASSERT_TRUE(header) << header.error().message;
  EXPECT_EQ((*header)->time_points, 3u);
  ASSERT_EQ((*header)->parts.size(), 2u);
  expect_failure(read_volume(path, {}, 1), "2 channels: choose one with --part", true);
  expect_failure(read_volume(path, {}, {}, "1"), "3 time points", true);
  expect_failure(read_volume(path, {}, 3, "1"), "no time point 3", true);
  expect_failure(read_volume(path, {}, 1, "2"), "no channel", true);
  const auto volume = read_volume(path, {}, 2, "1");
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(samples_of(*volume)[0], 90);  // page 9: channel 1 of slice 0 of time point 2
  EXPECT_EQ(samples_of(*volume)[6], 110);
  EXPECT_EQ(volume->grid.affine, Affine::of({0.5, 0.25, 2}));
  EXPECT_EQ(volume->labels.unit, "\u00b5m");
}

TEST_F(Tiff, OmeMayHaveUnitsOfEachAxisAndANamespace) {
  const auto with = [](const std::string& attributes) {
    return "<o:OME xmlns:o=\"http://www.openmicroscopy.org/Schemas/OME/2016-06\"><o:Image><o:Pixels DimensionOrder=\"XYZCT\" SizeC=\"1\" "
           "SizeT=\"1\" " +
           attributes + "/></o:Image></o:OME>";
  };
  const auto read = [&](const std::string& attributes) {
    return read_volume(folder_.file("v", testing::tiff_file(3, 2, pages(4), with(attributes))), {});
  };
  const auto volume =
      read("SizeZ=\"4\" PhysicalSizeX=\"2\" PhysicalSizeXUnit=\"nm\" PhysicalSizeY=\"3\" PhysicalSizeYUnit=\"nm\" PhysicalSizeZ=\"0.5\"");
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->labels.unit, "nm");
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(volume->grid.affine.spacing()[k], (Vec3{2, 3, 500}[k]), 1e-9) << k;
  expect_failure(read("SizeZ=\"5\""), "says that it has 5 slices");
  expect_failure(read("PhysicalSizeX=\"2\" PhysicalSizeY=\"3\" PhysicalSizeYUnit=\"pixel\""), "in different units");
}

TEST_F(Tiff, ImagejSaysDistances) {
  const auto volume =
      read_volume(folder_.file("v.tif", testing::tiff_file(3, 2, pages(4), "ImageJ=1.53\nimages=4\nslices=4\nunit=mm\nspacing=3\n")), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.affine.spacing()[2], 3);
  EXPECT_EQ(volume->labels.unit, "mm");
}

TEST_F(Tiff, WhatIsNoVolumeIsToldInOneLine) {
  const std::string whole = testing::tiff_file(3, 2, pages(3));
  std::vector<std::uint16_t> colours(18);
  expect_failure(read_volume(folder_.file("v", testing::tiff_file(3, 2, {colours, colours}, {}, 3)), {}), "in colour");
  expect_failure(read_volume(folder_.file("v", whole.substr(0, whole.size() - 40)), {}), "damaged or cut short");
  expect_failure(read_volume(folder_.file("v", whole.substr(0, 8)), {}), "cannot be read as TIFF");
  expect_failure(read_volume(folder_.file("v", testing::tiff_file(100'000, 100'000, pages(2))), {}), "which cannot be in it");
  expect_failure(read_volume(folder_.file("v", testing::tiff_file(3, 2, pages(1))), {}), "1 sample on axis z");
  expect_failure(read_volume(folder_.file("v", whole), RawLayout{{2, 2, 2}, SampleType::u8, false, 0, {}}), "describes itself", true);
  std::filesystem::create_directory(folder_ / "empty");
  expect_failure(read_volume(folder_ / "empty", {}), "a folder without TIFF or DICOM files");
}

std::vector<DicomImage> slices(int count) {  // 3 x 2, by instance from 1 on; 2.5 apart, tilted
  std::vector<DicomImage> images;
  for (int k = 0; k < count; ++k) {
    DicomImage image;
    image.instance = k + 1;
    image.position = "10\\" + std::to_string(20 + k) + "\\" + std::to_string(2.5 * k);
    image.intercept = "-1024";
    for (int i = 0; i < 6; ++i) image.pixels.push_back(std::int16_t(100 * k + i));
    images.push_back(image);
  }
  return images;
}

TEST_F(Dicom, ImagesAreSortedAlongTheNormal) {
  auto images = slices(7);
  std::shuffle(images.begin(), images.end(), std::mt19937(1));
  const auto path = scan(images);
  folder_.file("scan/README", "not an image");
  const auto header = read_volume_header(path);
  ASSERT_TRUE(header) << header.error().message;
  EXPECT_EQ((*header)->labels.space, "LPS");
  EXPECT_STREQ((*header)->format, "DICOM");
  const auto volume = read_volume(path, {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims, (std::array<std::int32_t, 3>{3, 2, 7}));
  EXPECT_EQ(volume->type, SampleType::i16);
  EXPECT_EQ(volume->labels.unit, "mm");
  EXPECT_EQ(volume->labels.field_unit, "HU");
  for (std::size_t k = 0; k < 7; ++k) EXPECT_EQ(samples_of(*volume)[6 * k + 4], double(100 * k) + 4 - 1024);
  const Affine tilted{{0.25, 0, 0, 10, 0, 0.5, 1, 20, 0, 0, 2.5, 0}};  // columns are 0.25 apart, rows 0.5
  for (std::size_t k = 0; k < 12; ++k) EXPECT_NEAR(volume->grid.affine.rows[k], tilted.rows[k], 1e-12) << k;
}

TEST_F(Dicom, MayBeOfImplicitVrWithoutItsFirstPart) {
  const auto images = slices(4);
  for (std::size_t k = 0; k < images.size(); ++k) {
    std::filesystem::create_directory(folder_ / "old");
    folder_.file("old/" + std::to_string(k), implicit_dicom_file(images[k]));
  }
  const auto volume = read_volume(folder_ / "old", {}), other = read_volume(scan(images), {});
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(volume->grid.dims, other->grid.dims);
  EXPECT_EQ(volume->grid.affine, other->grid.affine);
  EXPECT_EQ(volume->type, other->type);
  EXPECT_EQ(volume->bytes, other->bytes);
  const std::string whole = implicit_dicom_file(images[1]);
  folder_.file("old/1", whole.substr(0, whole.size() - 2));
  EXPECT_FALSE(read_volume(folder_ / "old", {}));
}

TEST(ImplicitDicom, BeginsWithAnElementOfGroup8AndAValueOfItsKind) {
  const auto begins = [](const std::string& element, const std::string& value, const std::string& next = std::string("\x08\0\x60\0\2\0\0\0CT", 10)) {
    return begins_as_dicom("\x08" + std::string(1, '\0') + element + std::string(1, '\0') + char(value.size()) + std::string(3, '\0') + value + next +
                           std::string(100, 'x'));
  };
  const std::string none(1, '\0');
  EXPECT_TRUE(begins(none, "\x80\2" + none + none));
  EXPECT_TRUE(begins("\x05", "ISO_IR 100"));
  EXPECT_TRUE(begins("\x08", "ORIGINAL\\PRIMARY\\AXIAL"));
  EXPECT_TRUE(begins("\x16", "1.2.840.10008.5.1.4.1.1.2" + none));
  EXPECT_FALSE(begins("\x05", "iso_ir 100"));
  EXPECT_FALSE(begins("\x05", "ISO_IR 10"));  // an odd length
  EXPECT_FALSE(begins("\x05", ""));
  EXPECT_FALSE(begins("\x16", "1.2.840.10008.A" + none));
  EXPECT_FALSE(begins("\x07", "ISO_IR 100"));
  EXPECT_FALSE(begins("\x16", "1.2.840.10008.5.1.4.1.1.2" + none, std::string("\x08\0\5\0\2\0\0\0CT", 10)));  // not in order
  EXPECT_FALSE(begins(none, std::string(4, '\0'), std::string(10, '\0')));
  for (const int step : {0, 1}) {  // samples of u16: 8, 8 and 8, 9 and so on
    std::string samples;
    for (int k = 0; k < 100; ++k) samples += {char(8 + step * k), '\0'};
    EXPECT_FALSE(begins_as_dicom(samples)) << step;
  }
}

TEST_F(Dicom, AMissingImageIsNamed) {
  auto images = slices(7);
  images.erase(images.begin() + 3);
  expect_failure(read_volume(scan(images), {}), "from '2' to '3', images 3 and 4 of 6, it is 5.38516, where most others are 2.69258");
}

TEST_F(Dicom, OneOfSeveralSeriesIsChosen) {
  auto images = slices(4);
  for (const DicomImage& image : slices(3)) {
    images.push_back(image);
    images.back().series = "9.8";
    images.back().pixels[0] = 7;
  }
  const auto path = scan(images);
  const auto header = read_volume_header(path);
  ASSERT_TRUE(header) << header.error().message;
  ASSERT_EQ((*header)->parts.size(), 2u);
  EXPECT_EQ((*header)->parts[0].name, "1.2.3");  // the largest first
  EXPECT_EQ((*header)->parts[1].about, "CT 3 x 2, 3 images");
  expect_failure(read_volume(path, {}), "2 series: choose one with --part: 1.2.3 (CT 3 x 2, 4 images), 9.8", true);
  expect_failure(read_volume(path, {}, {}, "9"), "no series '9'", true);
  const auto volume = read_volume(path, {}, {}, "9.8");
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims[2], 3);
  EXPECT_EQ(samples_of(*volume)[0], 7 - 1024);
}

TEST_F(Dicom, ImagesAtOnePlaceAreTimePoints) {
  auto images = slices(3);
  for (DicomImage image : slices(3)) {
    image.instance += 10;
    image.pixels[0] = 7;
    images.push_back(image);
  }
  const auto path = scan(images);
  expect_failure(read_volume(path, {}), "2 time points", true);
  const auto volume = read_volume(path, {}, 1);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.dims[2], 3);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(samples_of(*volume)[6 * k], 7 - 1024);
}

TEST_F(Dicom, ImagesMayHaveScalesOfTheirOwn) {
  auto images = slices(3);
  images[1].slope = "0.5";
  images[1].intercept = "3";
  const auto volume = read_volume(scan(images), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->type, SampleType::f32);
  EXPECT_EQ(samples_of(*volume)[6], 53);
  EXPECT_EQ(samples_of(*volume)[12], 200 - 1024);
}

// Of 13 bits, whatever the others are.
TEST_F(Dicom, SignsAreThoseOfTheStoredBits) {
  auto images = slices(2);
  for (auto& image : images) {
    image.bits = 13;
    image.intercept = "0";
    image.slope = "1";
    image.pixels = {6192, -2000, 2000, 4095, 4096, 8191};
  }
  const auto volume = read_volume(scan(images), {});
  ASSERT_TRUE(volume) << volume.error().message;
  const std::vector<double> expected{-2000, -2000, 2000, 4095, -4096, -1};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(samples_of(*volume)[i], expected[i]) << i;
}

TEST_F(Dicom, WhatIsDamagedIsNamed) {
  const auto path = scan(slices(3));
  const std::string whole = contents_of(path / "1");
  folder_.file("scan/1", whole.substr(0, whole.size() - 2));
  expect_failure(read_volume(path, {}), "/1' is cut short");
  std::string claims = whole;
  claims.replace(whole.size() - 16, 4, std::string("\0\0\0\xf0", 4));  // the length of the pixels
  folder_.file("scan/1", claims);
  const auto claimed = read_volume(path, {});
  ASSERT_FALSE(claimed);  // in another way under a sanitizer, where memory has no limit
  EXPECT_NE(claimed.error().message.find("/1' is "), std::string::npos) << claimed.error().message;
  auto other = slices(3)[1];
  other.rows = 3;
  other.pixels.resize(9);
  folder_.file("scan/1", dicom_file(other));  // a series of its own
  expect_failure(read_volume(path, {}), "2 series", true);
  expect_failure(read_volume(folder_.file("v", whole), {}), "1 sample on axis z");
}

// Whatever a library does with damaged files, a failure has one line, and what is read is of one piece. Most changes hit
// the header.
class DamagedFile : public ::testing::TestWithParam<unsigned> {
 protected:
  void expect_no_harm(const std::string& whole, std::size_t from, std::size_t header) const {
    std::mt19937 random(GetParam() + 1);
    for (int trial = 0; trial < 50; ++trial) {
      std::string bytes = whole;
      const std::size_t end = trial % 5 == 4 ? bytes.size() : std::min(header, bytes.size());
      for (int k = 0; k < 1 + trial / 15; ++k) bytes[from + random() % (end - from)] = char(random());
      if (trial % 10 == 0) bytes.resize(from + random() % (bytes.size() - from));
      const auto volume = read_volume(folder_.file("v", bytes), {}, 0);
      if (volume) {
        EXPECT_EQ(volume->bytes.size(), volume->grid.sample_count() * size_of(volume->type));
      } else {
        EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
      }
    }
  }
  const TempDir folder_;
};

TEST_P(DamagedFile, TiffDoesNoHarm) { expect_no_harm(testing::tiff_file(3, 2, pages(4)), 4, SIZE_MAX); }

TEST_P(DamagedFile, OmeTiffDoesNoHarm) {
  const std::string ome =
      "<OME><Image><Pixels DimensionOrder=\"XYZCT\" SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\"><TiffData IFD=\"2\" PlaneCount=\"2\"/><TiffData IFD=\"0\" "
      "FirstC=\"1\" PlaneCount=\"2\"/></Pixels></Image></OME>";
  expect_no_harm(testing::tiff_file(3, 2, pages(4), ome), 4, SIZE_MAX);
}

TEST_P(DamagedFile, ImagejDoesNoHarm) {
  expect_no_harm(testing::imagej_file(3, 2, std::vector<std::uint16_t>(30, 7), "ImageJ=1.53\nimages=5\nslices=5\n"), 4, 180);
}

TEST_P(DamagedFile, DicomDoesNoHarm) { expect_no_harm(dicom_file(slices(1)[0]), 132, 800); }

TEST_P(DamagedFile, ImplicitDicomDoesNoHarm) { expect_no_harm(implicit_dicom_file(slices(1)[0]), 8, 800); }

INSTANTIATE_TEST_SUITE_P(Fifty, DamagedFile, testing::seeds(0, 3));

TEST(HeaderLine, IsReadAsItWasWritten) {
  VolumeHeader header;
  header.grid = {{3, 4, 5}, Affine{{1, 2, 0, 4, 0, 5, 6, 7, 0, 0, 8, 9.5}}};
  header.type = SampleType::i32;
  header.labels = {"mm", "density \u00e9", "g/cm3", "LPS"};
  header.time_points = 7;
  header.slope = 0.1;
  header.intercept = -1e300;
  header.parts_are = "series";
  header.parts = {{"1.2", "two \"words\""}, {"3", ""}};
  const auto read = parse_header_line(header_line(header), "it");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->grid.dims, header.grid.dims);
  EXPECT_EQ(read->grid.affine, header.grid.affine);
  EXPECT_EQ(read->type, header.type);
  EXPECT_EQ(read->labels.field, header.labels.field);
  EXPECT_EQ(read->time_points, 7u);
  EXPECT_EQ(read->slope, 0.1);
  EXPECT_EQ(read->intercept, -1e300);
  ASSERT_EQ(read->parts.size(), 2u);
  EXPECT_EQ(read->parts[0].about, "two \"words\"");
}

TEST(HeaderLine, MayBeAnything) {
  VolumeHeader header;
  header.grid = {{3, 4, 5}, {}};
  const std::string whole = header_line(header);
  for (std::size_t length = 0; length < whole.size(); ++length) EXPECT_FALSE(parse_header_line(whole.substr(0, length), "it")) << length;
  for (const char* damage : {"[3,4,-5]", "[3,4,5e9]", "[3,4,99999999999999999999]", "[3,4]", "[3,4,\"5\"]", "{}", "null"}) {
    std::string line = whole;
    line.replace(line.find("[3,4,5]"), 7, damage);
    EXPECT_FALSE(parse_header_line(line, "it")) << damage;
  }
  EXPECT_FALSE(parse_header_line("{}", "it"));
  EXPECT_FALSE(parse_header_line(std::string(100'000, '['), "it"));
}

}  // namespace
}  // namespace intervale
