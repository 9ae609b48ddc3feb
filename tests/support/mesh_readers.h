// What files of meshes hold, read in the plainest way, independently of the writers. A file that is not as expected
// fails the test.
#pragma once

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/temp_dir.h"

namespace intervale {

using Triangle = std::array<std::uint32_t, 3>;
using Point = std::array<double, 3>;

inline double six_volume(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto u = [&](std::size_t i) { return b[i] - a[i]; };
  const auto v = [&](std::size_t i) { return c[i] - a[i]; };
  const auto w = [&](std::size_t i) { return d[i] - a[i]; };
  return (u(1) * v(2) - u(2) * v(1)) * w(0) + (u(2) * v(0) - u(0) * v(2)) * w(1) + (u(0) * v(1) - u(1) * v(0)) * w(2);
}

// What a surface file holds, whatever the format.
struct Surfaces {
  std::vector<Point> points;
  std::vector<std::uint8_t> surface;
  std::vector<Triangle> triangles;

  // By the divergence theorem; the reference point only makes the sum exact where it is.
  [[nodiscard]] double volume() const {
    double sum = 0;
    for (const auto& t : triangles) sum += six_volume(points[0], points[t[0]], points[t[1]], points[t[2]]);
    return sum / 6;
  }
  // Every edge has as many triangles one way as the other.
  [[nodiscard]] bool closed() const {
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : triangles)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto a = t[i], b = t[(i + 1) % 3];
        edges[std::minmax(a, b)] += a < b ? 1 : -1;
      }
    return std::all_of(edges.begin(), edges.end(), [](const auto& edge) { return edge.second == 0; });
  }
};

template <class T>
T take(std::string_view& bytes) {
  T value{};
  if (bytes.size() < sizeof value) throw std::out_of_range("file too short");
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes.remove_prefix(sizeof value);
  return value;
}

// The arrays of a VTK file by name, and the counts of its Piece.
struct Vtk {
  std::map<std::string, std::string> arrays, types;
  std::map<std::string, std::size_t> counts;
};

// What stands between `before` and `after`, at every place where `before` occurs. (g++ 12 warns about std::regex under
// sanitizers.)
inline std::vector<std::string> between(const std::string& text, const std::string& before, char after) {
  std::vector<std::string> found;
  for (auto at = text.find(before); at != text.npos; at = text.find(before, at + 1)) {
    const auto begin = at + before.size();
    found.push_back(text.substr(begin, text.find(after, begin) - begin));
  }
  return found;
}

inline std::string from_base64(std::string_view text) {
  std::string bytes;
  EXPECT_EQ(text.size() % 4, 0U);
  const auto padding = text.find('=') == text.npos ? 0 : text.size() - text.find('=');
  for (; text.size() >= 4; text.remove_prefix(4)) {
    std::uint32_t group = 0;
    for (const char digit : text.substr(0, 4)) {
      const auto value = std::string_view("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/").find(digit);
      EXPECT_TRUE(value != std::string_view::npos || (digit == '=' && text.size() == 4)) << digit;
      group = group << 6 | (value == std::string_view::npos ? 0 : static_cast<std::uint32_t>(value));
    }
    for (const int shift : {16, 8, 0}) bytes += static_cast<char>(group >> shift & 255);
  }
  EXPECT_LE(padding, 2U);
  bytes.resize(bytes.size() - padding);
  return bytes;
}

inline std::string from_zlib(std::string_view compressed, std::size_t size) {
  std::string bytes(size + 1, '\0');
  auto got = static_cast<uLongf>(bytes.size());
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(bytes.data()), &got, reinterpret_cast<const Bytef*>(compressed.data()),
                       static_cast<uLong>(compressed.size())),
            Z_OK);
  EXPECT_EQ(got, size);
  bytes.resize(size);
  return bytes;
}

// An inline array, read as vtkXMLDataParser reads it: a table of sizes in base64, then all blocks together as base64 of
// their own.
inline std::string read_inline_array(const std::string& text) {
  const auto number = [](const std::string& bytes, std::size_t i) {
    std::uint64_t value = 0;
    std::memcpy(&value, bytes.substr(sizeof value * i).c_str(), sizeof value);
    return value;
  };
  const auto blocks = number(from_base64(text.substr(0, 12)), 0);  // the first 12 digits hold no padding
  const auto table_digits = (sizeof(std::uint64_t) * (3 + blocks) + 2) / 3 * 4;
  const auto table = from_base64(text.substr(0, table_digits));
  const auto block_bytes = number(table, 1), last_bytes = number(table, 2);
  const auto compressed = from_base64(text.substr(table_digits));
  std::string bytes;
  std::size_t at = 0;
  for (std::size_t i = 0; i < blocks; ++i) {
    const auto size = number(table, 3 + i);
    bytes += from_zlib(compressed.substr(at, size), i + 1 == blocks && last_bytes != 0 ? last_bytes : block_bytes);
    at += size;
  }
  EXPECT_EQ(at, compressed.size());
  return bytes;
}

inline Vtk read_vtk(const std::filesystem::path& path) {
  Vtk vtk;
  const auto file = contents_of(path);
  for (const char* stated : {"byte_order=\"LittleEndian\"", "header_type=\"UInt64\"", "compressor=\"vtkZLibDataCompressor\""})
    EXPECT_NE(file.find(stated), file.npos) << stated;
  for (const auto& element : between(file, "<DataArray", '<')) {
    const auto attribute = [&](const std::string& name) { return between(element, " " + name + "=\"", '"').at(0); };
    EXPECT_EQ(attribute("format"), "binary");
    vtk.arrays[attribute("Name")] = read_inline_array(element.substr(element.find('>') + 1));
    vtk.types[attribute("Name")] = attribute("type");
  }
  for (const char* what : {"Points", "Cells", "Polys"})
    for (const auto& count : between(file, std::string("NumberOf") + what + "=\"", '"')) vtk.counts[what] = std::stoul(count);
  return vtk;
}

template <class T>
std::vector<T> as(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  if (!bytes.empty()) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

inline Surfaces read_vtp(const std::filesystem::path& path) {
  auto vtk = read_vtk(path);
  Surfaces read{as<Point>(vtk.arrays["Points"]), as<std::uint8_t>(vtk.arrays["surface"]), {}};
  const auto corners = as<std::int64_t>(vtk.arrays["connectivity"]), ends = as<std::int64_t>(vtk.arrays["offsets"]);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    EXPECT_EQ(ends[i], std::int64_t(3 * i + 3));
    read.triangles.push_back({std::uint32_t(corners[3 * i]), std::uint32_t(corners[3 * i + 1]), std::uint32_t(corners[3 * i + 2])});
  }
  EXPECT_EQ(vtk.counts["Points"], read.points.size());
  EXPECT_EQ(vtk.counts["Polys"], read.triangles.size());
  return read;
}

inline Surfaces read_ply(const std::filesystem::path& path) {
  const auto file = contents_of(path);
  const auto body = file.find("end_header\n") + 11;
  const auto count = [&](const std::string& what) { return std::stoul(between(file.substr(0, body), "element " + what + " ", '\n').at(0)); };
  Surfaces read;
  auto rest = std::string_view(file).substr(body);
  for (auto n = count("vertex"); n > 0; --n) {
    read.points.push_back(take<Point>(rest));
    read.surface.push_back(take<std::uint8_t>(rest));
  }
  for (auto n = count("face"); n > 0; --n) {
    EXPECT_EQ(take<std::uint8_t>(rest), 3);
    read.triangles.push_back(take<Triangle>(rest));
  }
  EXPECT_TRUE(rest.empty());
  return read;
}

inline Surfaces read_stl(const std::filesystem::path& path) {
  const auto file = contents_of(path);
  EXPECT_FALSE(file.starts_with("solid"));
  auto rest = std::string_view(file).substr(80);
  Surfaces read;
  std::map<std::array<float, 3>, std::uint32_t> number;
  for (auto n = take<std::uint32_t>(rest); n > 0; --n) {
    const auto normal = take<std::array<float, 3>>(rest);
    EXPECT_NEAR(std::hypot(normal[0], normal[1], normal[2]), 1, 1e-5);
    Triangle triangle;
    for (auto& corner : triangle) {
      const auto at = take<std::array<float, 3>>(rest);
      const auto [found, isnew] = number.try_emplace(at, static_cast<std::uint32_t>(read.points.size()));
      if (isnew) read.points.push_back({at[0], at[1], at[2]});
      corner = found->second;
    }
    EXPECT_EQ(take<std::uint16_t>(rest), 0);
    read.triangles.push_back(triangle);
  }
  EXPECT_TRUE(rest.empty());
  return read;
}

inline Surfaces read_obj(const std::filesystem::path& path) {
  Surfaces read;
  std::istringstream file(contents_of(path));
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      auto& p = read.points.emplace_back();
      words >> p[0] >> p[1] >> p[2];
    } else if (kind == "f") {
      auto& t = read.triangles.emplace_back();
      for (auto& corner : t) {
        words >> corner;
        --corner;
      }
    }
  }
  return read;
}

// Reads the two chunks by the byte counts the document gives.
inline Surfaces read_glb(const std::filesystem::path& path, std::string* document = nullptr) {
  const auto file = contents_of(path);
  std::string_view rest = file;
  EXPECT_EQ(take<std::uint32_t>(rest), 0x46546C67U);
  EXPECT_EQ(take<std::uint32_t>(rest), 2U);
  EXPECT_EQ(take<std::uint32_t>(rest), file.size());
  const auto text_size = take<std::uint32_t>(rest);
  EXPECT_EQ(text_size % 4, 0U);
  EXPECT_EQ(take<std::uint32_t>(rest), 0x4E4F534AU);
  const std::string text(rest.substr(0, text_size));
  if (document) *document = text;
  rest.remove_prefix(text_size);
  Surfaces read;
  if (rest.empty()) return read;
  const auto binary_size = take<std::uint32_t>(rest);
  EXPECT_EQ(binary_size + sizeof(std::uint32_t), rest.size());
  EXPECT_EQ(take<std::uint32_t>(rest), 0x004E4942U);
  std::vector<std::size_t> counts;
  for (const auto& count : between(text, "\"count\":", ',')) counts.push_back(std::stoul(count));
  for (std::size_t i = 0; i < counts.at(0); ++i) {
    const auto at = take<std::array<float, 3>>(rest);
    read.points.push_back({at[0], at[1], at[2]});
  }
  for (std::size_t i = 0; i < counts.at(1) / 3; ++i) read.triangles.push_back(take<Triangle>(rest));
  EXPECT_TRUE(rest.empty());
  return read;
}

}  // namespace intervale
