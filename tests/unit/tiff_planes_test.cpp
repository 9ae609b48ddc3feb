// Which pages of a TIFF file have which planes of a volume: what OME-XML and ImageJ say of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/read_volume.h"
#include "tests/support/library_files.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

class TiffPlanes : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(std::filesystem::read_symlink("/proc/self/exe").parent_path() / "read-tiff")) GTEST_SKIP() << "no read-tiff";
  }
  // Pages of 3 x 2, each with its own number.
  [[nodiscard]] std::filesystem::path file_of(std::uint16_t pages, const std::string& description, const std::string& name = "v.ome.tif") const {
    std::vector<std::vector<std::uint16_t>> all;
    for (std::uint16_t k = 0; k < pages; ++k) all.emplace_back(6, k);
    return folder_.file(name, testing::tiff_file(3, 2, all, description));
  }
  // The pages of a volume's slices.
  static std::vector<double> pages_in(const Result<Volume>& volume) {
    EXPECT_TRUE(volume) << volume.error().message;
    std::vector<double> pages;
    if (!volume) return pages;
    visit_samples(*volume, [&](auto samples) {
      for (std::size_t i = 0; i < samples.size(); i += 6) pages.push_back(double(samples[i]));
    });
    return pages;
  }
  // What OME-XML says of 2 slices, 2 channels and 1 time point.
  static std::string ome(const std::string& data, const std::string& sizes = "SizeZ=\"2\" SizeC=\"2\" SizeT=\"1\"") {
    return "<OME UUID=\"urn:uuid:1\"><Image><Pixels DimensionOrder=\"XYZCT\" " + sizes + ">" + data + "</Pixels></Image></OME>";
  }
  void expect_refused(std::uint16_t pages, const std::string& description, const std::string& about) const {
    const auto volume = read_volume(file_of(pages, description), {}, 0, "0");
    ASSERT_FALSE(volume) << about;
    EXPECT_NE(volume.error().message.find(about), std::string::npos) << volume.error().message;
    EXPECT_EQ(volume.error().message.find('\n'), std::string::npos) << volume.error().message;
  }
  const TempDir folder_;
};

using Numbers = std::vector<double>;

TEST_F(TiffPlanes, TiffDataNamesThePagesOfPlanes) {
  const auto read = [this](std::uint16_t pages, const std::string& data, const char* channel) {
    return pages_in(read_volume(file_of(pages, ome(data)), {}, {}, channel));
  };
  const std::string mixed =
      "<TiffData IFD=\"3\"/><TiffData IFD=\"0\" FirstZ=\"1\"/><TiffData IFD=\"2\" FirstC=\"1\"/><TiffData IFD=\"1\" FirstZ=\"1\" FirstC=\"1\"/>";
  EXPECT_EQ(read(4, mixed, "0"), (Numbers{3, 0}));
  EXPECT_EQ(read(4, mixed, "1"), (Numbers{2, 1}));
  for (const char* plain : {"", "<TiffData/>", "<TiffData IFD=\"0\" PlaneCount=\"4\"/>", "<TiffData PlaneCount=\"4\"/>"}) {
    EXPECT_EQ(read(4, plain, "0"), (Numbers{0, 1})) << plain;
    EXPECT_EQ(read(4, plain, "1"), (Numbers{2, 3})) << plain;
  }
  const std::string runs = "<TiffData IFD=\"5\" FirstC=\"1\" PlaneCount=\"2\"/><TiffData IFD=\"1\" PlaneCount=\"2\"/>";
  EXPECT_EQ(read(7, runs, "0"), (Numbers{1, 2}));  // other pages are another image's
  EXPECT_EQ(read(7, runs, "1"), (Numbers{5, 6}));
}

TEST_F(TiffPlanes, ThisFileIsKnownByItsNameOrItsUuid) {
  const auto in = [](const std::string& uuid) { return ome("<TiffData IFD=\"0\" PlaneCount=\"4\">" + uuid + "</TiffData>"); };
  for (const char* own :
       {"<UUID FileName=\"v.ome.tif\">urn:uuid:2</UUID>", "<UUID FileName=\"before.tif\">urn:uuid:1</UUID>", "<UUID>urn:uuid:1</UUID>"})
    EXPECT_EQ(pages_in(read_volume(file_of(4, in(own)), {}, {}, "0")), (Numbers{0, 1})) << own;
  expect_refused(4, in("<UUID FileName=\"other.tif\">urn:uuid:2</UUID>"), "planes of it are in another file, 'other.tif'");
  expect_refused(4, in("<UUID>urn:uuid:2</UUID>"), "planes of it are in another file, which it does not name");
}

TEST_F(TiffPlanes, TiffDataThatIsWrongIsRefused) {
  const std::string most = "18446744073709551615";
  expect_refused(4, ome("<TiffData IFD=\"4\"/>"), "TiffData names page 4, which it has not");
  expect_refused(4, ome("<TiffData IFD=\"2\" PlaneCount=\"" + most + "\"/>"), "TiffData names page 4");
  expect_refused(4, ome("<TiffData IFD=\"" + most + "\" PlaneCount=\"2\"/>"), "TiffData names page " + most);
  expect_refused(4, ome("<TiffData IFD=\"0\" FirstZ=\"2\"/>"), "tells of slice 2, channel 0, time point 0");
  expect_refused(4, ome("<TiffData IFD=\"0\"/><TiffData IFD=\"1\"/>"), "two pages for one plane");
  expect_refused(4, ome("<TiffData IFD=\"0\" PlaneCount=\"3\"/>"), "no page for plane 3 of 4");
  expect_refused(3, ome("<TiffData IFD=\"0\" PlaneCount=\"3\"/>"), "are pages missing?");
  expect_refused(4, ome("<TiffData/>", "SizeZ=\"" + most + "\" SizeC=\"2\" SizeT=\"2\""), "are pages missing?");
  expect_refused(4, ome("<TiffData/>", "SizeZ=\"2\" SizeC=\"4\" SizeT=\"4\""), "which are not those of 4 channels and 4 time points");
}

TEST_F(TiffPlanes, ImagejLeavesOutThePagesOfLongStacks) {
  std::vector<std::uint16_t> numbers;
  for (std::uint16_t k = 0; k < 36; ++k) numbers.push_back(std::uint16_t(1000 + k / 6));
  const auto file = [&](const std::string& about) { return testing::imagej_file(3, 2, numbers, "ImageJ=1.53\n" + about); };
  EXPECT_EQ(pages_in(read_volume(folder_.file("v", file("images=5\nslices=5\n")), {})), (Numbers{1000, 1001, 1002, 1003, 1004}));
  const auto several = folder_.file("w", file("images=6\nchannels=2\nslices=3\nhyperstack=true\n"));
  EXPECT_EQ(pages_in(read_volume(several, {}, {}, "1")), (Numbers{1001, 1003, 1005}));
  for (const auto& [about, complaint] :
       {std::pair("images=7\n", "it says that it has 7 images of 12 bytes, which are not in it"),
        std::pair("images=18446744073709551615\n", "larger than a volume may be"), std::pair("images=6\nslices=5\n", "says that it has 5 slices")}) {
    const auto volume = read_volume(folder_.file("v", file(about)), {});
    ASSERT_FALSE(volume) << about;
    EXPECT_NE(volume.error().message.find(complaint), std::string::npos) << volume.error().message;
  }
}

}  // namespace
}  // namespace intervale
