// Headers that contradict themselves or their data are refused; other spellings that the formats allow are read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <tuple>
#include <vector>

#include "common/patch/visit_samples.h"
#include "server/volume/read_volume.h"
#include "server/volume/volume_header.h"
#include "tests/support/temp_dir.h"
#include "tests/support/volume_files.h"

namespace intervale {
namespace {

// Eight floats from 1 on, little-endian or, reversed one by one, big-endian.
std::string eight_floats(bool big_endian = false) {
  std::string bytes;
  for (int i = 1; i <= 8; ++i) {
    const auto value = float(i);
    std::string one(sizeof value, '\0');
    std::memcpy(one.data(), &value, sizeof value);
    if (big_endian) std::reverse(one.begin(), one.end());
    bytes += one;
  }
  return bytes;
}
std::string count(std::uint32_t number) { return {reinterpret_cast<const char*>(&number), sizeof number}; }

std::vector<double> numbers_in(const Volume& volume) {
  return visit_samples(volume, [](auto samples) { return std::vector<double>(samples.begin(), samples.end()); });
}
const std::vector<double> kOneToEight{1, 2, 3, 4, 5, 6, 7, 8};

void expect_read(const std::string& bytes) {
  const TempDir folder;
  const auto volume = read_volume(folder.file("v", bytes), {});
  ASSERT_TRUE(volume) << volume.error().message << "\n" << bytes.substr(0, 600);
  EXPECT_EQ(numbers_in(*volume), kOneToEight) << bytes.substr(0, 600);
}
void expect_no_volume(const std::string& bytes) {
  const TempDir folder;
  const auto volume = read_volume(folder.file("v", bytes), {});
  EXPECT_FALSE(volume) << bytes.substr(0, 600);
}

// lines: besides those that are needed; in place of ElementType, if they have one.
std::string metaimage_with(const std::string& lines, const std::string& data = eight_floats()) {
  const std::string type = lines.find("ElementType") == std::string::npos ? "ElementType = MET_FLOAT\n" : "";
  return "ObjectType = Image\nNDims = 3\nDimSize = 2 2 2\n" + type + lines + "ElementDataFile = LOCAL\n" + data;
}

TEST(MetaImageHeader, WhatIsNotUnderstoodIsRefused) {
  for (const char* lines :
       {"ElementType = MET_LONG_LONG\n", "ElementType = MET_FLOAT_ARRAY\n", "ElementSpacing = 2,3,4\n", "ElementSpacing = 2 3\n",
        "ElementSpacing = a b c\n", "Offset = 10 20 30mm\n", "TransformMatrix = 0 1 0 -1 0 0 0 0 1.0f\n", "HeaderSize = 4 bytes\n",
        "HeaderSize = -2\n", "ElementNumberOfChannels = three\n", "ElementNumberOfChannels = 2\n", "BinaryDataByteOrderMSB = perhaps\n",
        "BinaryDataByteOrderMSB = False\nElementByteOrderMSB = True\n", "BinaryData = False\n", "CompressedData = maybe\n"})
    expect_no_volume(metaimage_with(lines));
  expect_no_volume("ObjectType = Image\nNDims = 3\nDimSize = 2.9 2 2\nElementType = MET_FLOAT\nElementDataFile = LOCAL\n" + eight_floats());
}

TEST(MetaImageHeader, OtherSpellingsAreRead) {
  for (const char* lines : {"", "\n \nCompressedData : No\n", "BinaryDataByteOrderMSB = 0\n", "elementnumberofchannels = +1\n", "HeaderSize = 0\n"})
    expect_read(metaimage_with(lines));
  expect_read(metaimage_with("BinaryDataByteOrderMSB = 1\n", eight_floats(true)));
  expect_read(metaimage_with("CompressedData = Yes\n", testing::deflated(eight_floats(), testing::Wrapping::zlib)));
  const TempDir folder;
  const auto volume = read_volume(folder.file("v", metaimage_with("ElementSpacing = +2 +3 +4\nOffset = 1 2 3\n")), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->grid.affine, Affine::of({2, 3, 4}, {1, 2, 3}));
}

std::string vtk_with(const std::string& coding, const std::string& lines, const std::string& data) {
  return "# vtk DataFile Version 3.0\nby hand\n" + coding + "\n" + lines + data + "\n";
}
const std::string kGridLines = "DATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n";
const std::string kScalars = "SCALARS s float\nLOOKUP_TABLE default\n";

TEST(LegacyVtkHeader, CountsThatContradictEachOtherAreRefused) {
  for (const std::string& lines :
       {kGridLines + "POINT_DATA 27\n" + kScalars, kGridLines + "POINT_DATA 1\n" + kScalars, kGridLines + "POINT_DATA 8\nSCALARS s float\n1\n",
        kGridLines + "POINT_DATA 8\nSCALARS s float\n", kGridLines + "POINT_DATA 8\nFIELD FieldData 2\nother 1 4 float\n", kGridLines + kScalars,
        "DIMENSIONS 2 2 2\nPOINT_DATA 8\n" + kScalars, kGridLines + "POINT_DATA 8\nSCALARS s long\nLOOKUP_TABLE default\n"})
    expect_no_volume(vtk_with("BINARY", lines, eight_floats(true) + std::string(64, '\0')));
  expect_no_volume(
      vtk_with("BINARY", "DATASET STRUCTURED_POINTS\nDIMENSIONS 1046853 856910 856816\nPOINT_DATA 8\nVECTORS v double\n", eight_floats(true)));
}

TEST(LegacyVtkHeader, OtherSpellingsAreRead) {
  expect_read(vtk_with("BINARY", kGridLines + "POINT_DATA 8\n" + kScalars, eight_floats(true)));
  expect_read(vtk_with("binary",
                       "dataset structured_points\ndimensions 2 2 2\norigin +1 0 0\npoint_data 8\nscalars s FLOAT 1\nlookup_table default\n",
                       eight_floats(true)));
  expect_read(vtk_with("ASCII", kGridLines + "FIELD FieldData 2\nTimeValue 1 1 double\n0.5\nmore 2 2 int\n1 2\n3 4\nPOINT_DATA 8\n" + kScalars,
                       "1 2 3 4 5 6 7 8"));
  expect_read(vtk_with("BINARY",
                       kGridLines + "FIELD FieldData 1\nTimeValue 1 1 float\n" + eight_floats(true).substr(0, 4) + "\nPOINT_DATA 8\n" + kScalars,
                       eight_floats(true)));
  const TempDir folder;
  const auto named = vtk_with("ASCII", kGridLines + "POINT_DATA 8\nSCALARS my%20a float\nLOOKUP_TABLE default\n", "1 2 3 4 5 6 7 1e-60");
  const auto volume = read_volume(folder.file("v.vtk", named), {});
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->labels.field, "my a");
  EXPECT_EQ(numbers_in(*volume).back(), 0);
}

// An appended or inline array of floats.
struct Vti {
  std::string root = "byte_order=\"LittleEndian\"", extent = "0 1 0 1 0 1", piece = "0 1 0 1 0 1", image, points, name = "s", format = "appended",
              offset = "offset=\"0\"", more, content, encoding = "raw", appended = count(32) + eight_floats();
  [[nodiscard]] std::string bytes() const {
    std::string text = "<VTKFile type=\"ImageData\" ";
    text += root + "><ImageData WholeExtent=\"" + extent + "\" " + image + "><Piece Extent=\"" + piece + "\"><PointData " + points;
    text += "><DataArray type=\"Float32\" Name=\"" + name + "\" format=\"" + format + "\" " + offset + " " + more + ">" + content;
    text += "</DataArray></PointData></Piece></ImageData>";
    if (format == "appended") text += "<AppendedData encoding=\"" + encoding + "\">_" + appended + "</AppendedData>";
    return text + "</VTKFile>";
  }
};
const std::string kZlib = "byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"";

TEST(VtiHeader, WhatContradictsItselfIsRefused) {
  const std::string floats = eight_floats(), whole = count(32) + floats, packed = testing::deflated(floats, testing::Wrapping::zlib);
  for (const Vti& vti : std::vector<Vti>{
           {.appended = count(16) + floats.substr(0, 16) + count(16) + floats.substr(16)},
           {.appended = count(4000000000) + floats},
           {.root = "byte_order=\"PDP\""},
           {.root = "byte_order=\"LittleEndian\" header_type=\"UInt16\""},
           {.extent = "10 11 10 11 10 11"},
           {.image = "NumberOfTimeSteps=\"2\""},
           {.points = "Scalars=\"other\""},
           {.offset = ""},
           {.offset = "offset=\"-1\""},
           {.offset = "offset=\"1e1\""},
           {.more = "NumberOfComponents=\"1x\""},
           {.more = "NumberOfTuples=\"4\""},
           {.more = "TimeStep=\"1\""},
           {.encoding = "hex"},
           {.root = kZlib, .appended = count(250000000) + count(32) + count(0) + count(std::uint32_t(packed.size())) + packed},
           {.root = kZlib, .appended = count(1) + count(16) + count(0) + count(std::uint32_t(packed.size())) + packed},
           {.root = kZlib, .appended = count(0) + count(32) + count(0)},
       })
    expect_no_volume(vti.bytes());
  const std::string text = testing::base64(whole);
  for (const std::string& wrong : {text.substr(0, 20) + "AA==" + text.substr(20), text.substr(0, 20) + "A=AA" + text.substr(20), text.substr(0, 20)})
    expect_no_volume(Vti{.format = "binary", .content = wrong}.bytes());
}

TEST(VtiHeader, OtherSpellingsAreRead) {
  const std::string floats = eight_floats(), text = testing::base64(count(32) + floats);
  const std::string packed = testing::deflated(floats, testing::Wrapping::zlib);
  for (const Vti& vti : std::vector<Vti>{
           {},
           {.points = "Scalars=\"\""},
           {.name = ">1 2 3 4 5 6 7 9 "},
           {.name = "s>", .format = "ascii", .content = "1 2 3 4 5 6 7 8"},
           {.format = "ascii", .content = "\n1 2 3 4 5 6 7 8\n"},
           {.format = "binary", .content = text},
           {.format = "binary", .content = "\n" + text.substr(0, 20) + "\n  " + text.substr(20)},
           {.format = "binary", .content = testing::base64(count(32)) + testing::base64(floats)},
           {.encoding = "base64", .appended = text + "AAAA"},
           {.root = kZlib, .appended = count(1) + count(32) + count(0) + count(std::uint32_t(packed.size())) + packed + "x"},
       })
    expect_read(vti.bytes());
  std::string quoted = Vti().bytes();
  quoted.replace(quoted.find("type=\"ImageData\""), 16, "type = 'ImageData'");
  expect_read("<!-- <VTKFile type=\"PolyData\"> -->" + quoted);
}

TEST(Rescale, KeepsApartWhatTheStoredNumbersDo) {
  for (const auto& [type, slope, intercept] : std::vector<std::tuple<SampleType, double, double>>{{SampleType::u8, 0.5, 1e9},
                                                                                                  {SampleType::f32, 1, 1e9},
                                                                                                  {SampleType::f32, 1e-40, 0},
                                                                                                  {SampleType::u8, 0x1p40, 1},
                                                                                                  {SampleType::i16, 1e-30, 0},
                                                                                                  {SampleType::u16, 1.5, 7}}) {
    Volume volume{"v", {{2, 2, 2}, {}}, type, {}};
    volume.bytes.resize(8 * size_of(type));
    for (std::size_t i = 0; i < 8; ++i) {
      const auto real = float(i + 1);
      const auto whole = std::uint16_t(i + 1);
      std::memcpy(&volume.bytes[i * size_of(type)], type == SampleType::f32 ? static_cast<const void*>(&real) : &whole, size_of(type));
    }
    rescale(volume, slope, intercept);
    const auto samples = numbers_in(volume);
    for (std::size_t i = 0; i < 8; ++i) EXPECT_NEAR(samples[i], slope * double(i + 1) + intercept, std::abs(slope) / 8) << slope;
  }
}

}  // namespace
}  // namespace intervale
