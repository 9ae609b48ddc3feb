#include "tests/support/volume_files.h"

#include <bzlib.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace intervale::testing {
namespace {

constexpr std::size_t kSamples = 24;

template <class T>
std::string number(T value, bool big_endian) {
  std::string bytes(sizeof(T), '\0');
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

// The stored numbers of the samples plus `more`.
template <class T>
std::string samples(bool big_endian, int more = 0) {
  std::string bytes;
  for (std::size_t i = 0; i < kSamples; ++i) bytes += number(T(sample_in_file(i) + more), big_endian);
  return bytes;
}

std::string text_of_samples() {
  std::string text;
  for (std::size_t i = 0; i < kSamples; ++i) text += std::to_string(sample_in_file(i)) + (i % 6 == 5 ? "\n" : " ");
  return text;
}

// A header of this many zero bytes, in which numbers are set.
class Header {
 public:
  Header(std::size_t size, bool big_endian) : bytes_(size, '\0'), big_endian_(big_endian) {}
  template <class T>
  Header& set(std::size_t at, std::initializer_list<T> numbers) {
    for (const T value : numbers) {
      bytes_.replace(at, sizeof(T), number(value, big_endian_));
      at += sizeof(T);
    }
    return *this;
  }
  Header& text(std::size_t at, const std::string& text) {
    bytes_.replace(at, text.size(), text);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  bool big_endian_;
};

using Int = std::int32_t;
using Short = std::int16_t;
using Long = std::int64_t;

// 90 degrees about z, 2 apart along x; the third axis mirrored.
const Affine kTurned = Affine::of_columns({{{0, 2, 0}, {-1, 0, 0}, {0, 0, -3}}}, {5, 6, 7});
const Affine kStraight = Affine::of({0.5, 1, 2}, {-1, 2, 3});

std::string nifti1(bool big_endian) {
  Header header(352, big_endian);
  header.set<Int>(0, {348}).set<Short>(40, {3, 3, 2, 4, 1, 1, 1, 1}).set<Short>(70, {4, 16}).set<float>(76, {1, 2, 1, 3, 0, 0, 0, 0});
  header.set<float>(108, {352, 1, 0}).set<char>(123, {2}).set<Short>(252, {0, 1});
  header.set<float>(280, {0, -1, 0, 5, 2, 0, 0, 6, 0, 0, -3, 7}).text(344, "n+1");
  return header.bytes() + samples<Short>(big_endian);
}

// By its quaternion, of unsigned numbers 500 too great, with two time points, of which the first is only zeros.
std::string nifti2(bool big_endian) {
  Header header(544, big_endian);
  header.set<Int>(0, {540}).text(4, std::string("n+2\0\r\n\x1a\n", 8)).set<Short>(12, {512, 16}).set<Long>(16, {4, 3, 2, 4, 2, 1, 1, 1});
  header.set<double>(104, {-1, 2, 1, 3, 1, 0, 0, 0}).set<Long>(168, {544}).set<double>(176, {1, -500}).set<Int>(344, {1, 0});
  header.set<double>(352, {0, 0, std::sqrt(0.5), 5, 6, 7});
  return header.bytes() + std::string(2 * kSamples, '\0') + samples<std::uint16_t>(big_endian, 500);
}

std::string mrc(bool big_endian) {
  Header header(1024, big_endian);
  header.set<Int>(0, {3, 2, 4, 2, 0, 0, 0, 3, 2, 4}).set<float>(40, {1.5, 2, 8, 90, 90, 90}).set<Int>(64, {1, 2, 3}).set<Int>(92, {16});
  header.set<float>(196, {-1, 2, 3}).text(208, "MAP ").text(212, big_endian ? "\x11\x11" : "DA");
  return header.bytes() + std::string(16, 'e') + samples<float>(big_endian);
}

// Its fastest axis is the cell's third one, and its first index is not 0.
std::string turned_mrc() {
  Header header(1024, false);
  header.set<Int>(0, {3, 2, 4, 1, 1, 2, 3, 4, 2, 3}).set<float>(40, {4, 4, 9, 0, 0, 0}).set<Int>(64, {3, 2, 1}).text(208, "MAP ").text(212, "DA");
  return header.bytes() + samples<Short>(false);
}

std::string npy(const std::string& descr, bool is_fortran, const std::string& shape, const std::string& data) {
  std::string text = "{'descr': '" + descr + "', 'fortran_order': " + (is_fortran ? "True" : "False") + ", 'shape': " + shape + ", }";
  text.resize((text.size() + 10) / 64 * 64 + 53, ' ');
  return std::string("\x93NUMPY\x01\0", 8) + number(std::uint16_t(text.size() + 1), false) + text + "\n" + data;
}

std::string metaimage(const std::string& more, const std::string& data) {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\nElementSpacing = 2 1 3\nOffset = 5 6 7\nTransformMatrix = 0 1 0 -1 0 0 0 0 -1\n"
         "AnatomicalOrientation = RAI\nDimSize = 3 2 4\n" +
         more + "ElementDataFile = LOCAL\n" + data;
}

std::string vtk(const std::string& coding, const std::string& array, const std::string& data) {
  return "# vtk DataFile Version 3.0\nmade by a test\n" + coding +
         "\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 4\nORIGIN -1 2 3\nSPACING 0.5 1 2\nPOINT_DATA 24\n" + array + data;
}

// data: of the array's element; appended: of AppendedData. 1 is the first index of each axis.
std::string vti(const std::string& root, const std::string& array, const std::string& data, const std::string& appended) {
  return "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" " + root +
         ">\n<ImageData WholeExtent=\"1 3 1 2 1 4\" Origin=\"6 4 10\" Spacing=\"2 1 3\" Direction=\"0 -1 0 1 0 0 0 0 -1\">\n"
         "<Piece Extent=\"1 3 1 2 1 4\">\n<PointData Scalars=\"density\">\n<DataArray type=\"Float64\" Name=\"other\" format=\"appended\" "
         "offset=\"0\"/>\n<DataArray Name=\"density\" " +
         array + ">" + data + "</DataArray>\n</PointData>\n</Piece>\n</ImageData>\n" + appended + "</VTKFile>\n";
}

// Two blocks of 28 and 20 bytes, with the counts that precede them.
template <class Count>
std::pair<std::string, std::string> blocks(const std::string& data, bool big_endian) {
  const std::string first = deflated(data.substr(0, 28), Wrapping::zlib), second = deflated(data.substr(28), Wrapping::zlib);
  std::string counts;
  for (const std::size_t count : {std::size_t(2), std::size_t(28), std::size_t(20), first.size(), second.size()})
    counts += number(Count(count), big_endian);
  return {counts, first + second};
}

std::string vti_of_blocks(bool is_base64) {
  const auto [counts, data] = blocks<std::uint32_t>(samples<Short>(false), false);
  const std::string root = "byte_order=\"LittleEndian\" compressor=\"vtkZLibDataCompressor\"";
  if (is_base64) return vti(root, "type=\"Int16\" format=\"binary\"", "\n  " + base64(counts) + base64(data) + "\n", "");
  return vti(root, "type=\"Int16\" format=\"appended\" offset=\"5\"", "",
             "<AppendedData encoding=\"raw\">\n   _other" + counts + data + "xxxx\n</AppendedData>\n");
}

std::string nrrd(const std::string& more, const std::string& data) {
  return "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 4\nspace: left-posterior-superior\n"
         "space directions: (0,2,0) (-1,0,0) (0,0,-3)\nspace origin: (5,6,7)\n" +
         more + "\n" + data;
}

}  // namespace

int sample_in_file(std::size_t number) {
  const auto i = int(number % 3), j = int(number / 3 % 2), k = int(number / 6);
  return i + 10 * j - 100 * k;
}

std::string deflated(const std::string& text, Wrapping wrapping) {
  z_stream stream{};
  if (deflateInit2(&stream, 6, Z_DEFLATED, wrapping == Wrapping::gzip ? 15 + 16 : 15, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::runtime_error("deflateInit2");
  std::string packed(deflateBound(&stream, text.size()) + 64, '\0'), copy = text;
  stream.next_in = reinterpret_cast<Bytef*>(copy.data());
  stream.avail_in = uInt(copy.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = uInt(packed.size());
  if (deflate(&stream, Z_FINISH) != Z_STREAM_END) throw std::runtime_error("deflate");
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? std::uint8_t(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::string bzip2(const std::string& text) {
  std::string packed(text.size() + text.size() / 100 + 600, '\0'), copy = text;
  auto length = unsigned(packed.size());
  if (BZ2_bzBuffToBuffCompress(packed.data(), &length, copy.data(), unsigned(copy.size()), 9, 0, 0) != BZ_OK) throw std::runtime_error("bzip2");
  packed.resize(length);
  return packed;
}

const std::vector<VolumeFile>& volume_files() {
  static const std::vector<VolumeFile> files{
      {"little.nii", nifti1(false), SampleType::i16, kTurned, "RAS"},
      {"big.nii", nifti1(true), SampleType::i16, kTurned, "RAS"},
      {"packed.nii.gz", deflated(nifti1(true), Wrapping::gzip), SampleType::i16, kTurned, "RAS"},
      {"second.nii", nifti2(false), SampleType::i16, kTurned, "RAS", 1, 2},
      {"second_big.nii.gz", deflated(nifti2(true), Wrapping::gzip), SampleType::i16, kTurned, "RAS", 1, 2},
      {"little.mrc", mrc(false), SampleType::f32, kStraight, ""},
      {"big.map", mrc(true), SampleType::f32, kStraight, ""},
      {"turned.mrc", turned_mrc(), SampleType::i16, Affine::of_columns({{{0, 0, 3}, {0, 2, 0}, {1, 0, 0}}}, {3, 4, 3}), ""},
      {"c.npy", npy("<i2", false, "(4, 2, 3)", samples<Short>(false)), SampleType::i16, Affine(), ""},
      {"fortran.npy", npy(">f8", true, "(3, 2, 4)", samples<double>(true)), SampleType::f64, Affine(), ""},
      {"times.npy", npy("<i4", true, "(3, 2, 4, 2)", samples<Int>(false, 1) + samples<Int>(false)), SampleType::i32, Affine(), "", 1, 2},
      {"plain.mha", metaimage("ElementType = MET_SHORT\nElementByteOrderMSB = True\n", samples<Short>(true)), SampleType::i16, kTurned, "LPS"},
      {"packed.mha", metaimage("CompressedData = True\nElementType = MET_FLOAT\n", deflated(samples<float>(false), Wrapping::zlib)), SampleType::f32,
       kTurned, "LPS"},
      {"text.vtk", vtk("ASCII", "SCALARS density float 1\nLOOKUP_TABLE default\n", text_of_samples()), SampleType::f32, kStraight, ""},
      {"binary.vtk", vtk("BINARY", "SCALARS density short 1\nLOOKUP_TABLE default\n", samples<Short>(true)), SampleType::i16, kStraight, ""},
      {"field.vtk", vtk("BINARY", "FIELD FieldData 1\ndensity 1 24 int\n", samples<Int>(true)), SampleType::i32, kStraight, ""},
      {"text.vti", vti("", "type=\"Float32\" format=\"ascii\"", "\n" + text_of_samples(), ""), SampleType::f32, kTurned, "", 0, 1, "</DataArray>"},
      {"base64.vti",
       vti("byte_order=\"BigEndian\" header_type=\"UInt64\"", "type=\"Int16\" format=\"binary\"",
           "\n" + base64(number(std::uint64_t(2 * kSamples), true) + samples<Short>(true)), ""),
       SampleType::i16, kTurned, "", 0, 1, "</DataArray>"},
      {"blocks.vti", vti_of_blocks(false), SampleType::i16, kTurned, "", 0, 1, "xxxx"},
      {"base64_blocks.vti", vti_of_blocks(true), SampleType::i16, kTurned, "", 0, 1, "</DataArray>"},
      {"raw.nrrd", nrrd("endian: big\nencoding: raw\n", samples<Short>(true)), SampleType::i16, kTurned, "LPS"},
      {"packed.nrrd", nrrd("endian: little\nencoding: gzip\n", deflated(samples<Short>(false), Wrapping::gzip)), SampleType::i16, kTurned, "LPS"},
      {"bzip2.nrrd", nrrd("endian: little\nencoding: bzip2\n", bzip2(samples<Short>(false))), SampleType::i16, kTurned, "LPS"},
      {"text.nrrd", nrrd("encoding: ascii\n", text_of_samples()), SampleType::i16, kTurned, "LPS"},
      {"times.nrrd",
       "NRRD0004\ntype: short\ndimension: 4\nsizes: 3 2 4 2\nkinds: domain domain domain time\nendian: little\nencoding: raw\n\n" +
           samples<Short>(false, 7) + samples<Short>(false),
       SampleType::i16, Affine(), "", 1, 2},
  };
  return files;
}

}  // namespace intervale::testing
