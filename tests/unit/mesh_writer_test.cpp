#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>
#include <sstream>
#include <string>

#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Point = std::array<double, 3>;

// A block of n^3 cubes, each of six positive tetrahedra around its diagonal; points shifted far from the origin and a
// little shaken.
Mesh block(std::uint32_t n, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shake(-0.1, 0.1);
  Mesh mesh;
  const std::uint32_t side = n + 1;
  for (std::uint32_t z = 0; z < side; ++z)
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        mesh.points.push_back({100.0 + x + shake(random), -7.0 + y + shake(random), 0.0 + z + shake(random)});
        mesh.surface.push_back(static_cast<Surface>(random() % 3));
      }
  const std::array<std::uint32_t, 3> step{1, side, side * side};
  for (std::uint32_t z = 0; z < n; ++z)
    for (std::uint32_t y = 0; y < n; ++y)
      for (std::uint32_t x = 0; x < n; ++x) {
        std::array<std::uint32_t, 3> axes{0, 1, 2};
        bool even = true;
        do {
          const std::uint32_t a = x + side * (y + side * z), b = a + step[axes[0]], c = b + step[axes[1]], d = c + step[axes[2]];
          even = (axes[0] < axes[1]) == ((axes[1] < axes[2]) == (axes[0] < axes[2]));
          mesh.tets.push_back(even ? std::array{a, b, c, d} : std::array{a, c, b, d});
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

double six_volume(const Point& a, const Point& b, const Point& c, const Point& d) {
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
std::vector<std::string> between(const std::string& text, const std::string& before, char after) {
  std::vector<std::string> found;
  for (auto at = text.find(before); at != text.npos; at = text.find(before, at + 1)) {
    const auto begin = at + before.size();
    found.push_back(text.substr(begin, text.find(after, begin) - begin));
  }
  return found;
}

std::string from_base64(std::string_view text) {
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

std::string from_zlib(std::string_view compressed, std::size_t size) {
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
std::string read_inline_array(const std::string& text) {
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

Vtk read_vtk(const std::filesystem::path& path) {
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

Surfaces read_vtp(const std::filesystem::path& path) {
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

Surfaces read_ply(const std::filesystem::path& path) {
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

Surfaces read_stl(const std::filesystem::path& path) {
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

Surfaces read_obj(const std::filesystem::path& path) {
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
Surfaces read_glb(const std::filesystem::path& path, std::string* document = nullptr) {
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

using Reader = Surfaces (*)(const std::filesystem::path&);
const std::map<std::string, std::pair<Reader, double>> kSurfaceFormats{
    // and the precision that the format keeps
    {"m.vtp", {read_vtp, 1e-12}},
    {"m.ply", {read_ply, 1e-12}},
    {"m.stl", {read_stl, 1e-5}},
    {"m.obj", {read_obj, 1e-12}},
    {"m.glb", {[](const std::filesystem::path& path) { return read_glb(path); }, 1e-5}}};

TEST(MeshWriter, BoundaryOfABlockIsItsClosedOutwardHull) {
  const std::uint32_t n = 5;
  const auto mesh = block(n, 7);
  const Surfaces hull{{mesh.points.begin(), mesh.points.end()}, {}, boundary_triangles(mesh)};
  EXPECT_EQ(hull.triangles.size(), 6 * n * n * 2);
  EXPECT_TRUE(hull.closed());
  EXPECT_NEAR(hull.volume(), volume_of(mesh), 1e-12 * volume_of(mesh));
}

// The naive model: count every face in a map.
TEST(MeshWriter, BoundaryEqualsCountingFaces) {
  for (std::uint32_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    auto mesh = block(3, seed);
    std::mt19937 random(seed);
    std::shuffle(mesh.tets.begin(), mesh.tets.end(), random);
    mesh.tets.resize(random() % mesh.tets.size());
    std::map<std::set<std::uint32_t>, int> times;
    for (const auto& t : mesh.tets)
      for (std::size_t skip = 0; skip < 4; ++skip) {
        std::set<std::uint32_t> face(t.begin(), t.end());
        face.erase(t[skip]);
        ++times[face];
      }
    std::set<std::set<std::uint32_t>> expected, got;
    for (const auto& [face, count] : times)
      if (count == 1) expected.insert(face);
    const auto triangles = boundary_triangles(mesh);
    for (const auto& t : triangles) got.insert({t[0], t[1], t[2]});
    EXPECT_EQ(got, expected);
    EXPECT_EQ(triangles.size(), expected.size());
  }
}

TEST(MeshWriter, VolumeDoesNotDependOnTheOrder) {
  auto mesh = block(8, 3);
  const double volume = volume_of(mesh);
  EXPECT_GT(volume, 0);
  std::mt19937 random(11);
  for (int i = 0; i < 5; ++i) {
    std::shuffle(mesh.tets.begin(), mesh.tets.end(), random);
    EXPECT_NEAR(volume_of(mesh), volume, 1e-12 * volume);
  }
  EXPECT_EQ(volume_of(Mesh{}), 0);
}

TEST(MeshWriter, VtuHoldsEveryPointAndTetrahedron) {
  const TempDir folder;
  const auto mesh = block(20, 5);  // several blocks of zlib's in most arrays
  ASSERT_TRUE(write_mesh(folder / "m.vtu", mesh));
  auto vtk = read_vtk(folder / "m.vtu");
  EXPECT_EQ(vtk.types, (std::map<std::string, std::string>{
                           {"surface", "UInt8"}, {"Points", "Float64"}, {"connectivity", "Int64"}, {"offsets", "Int64"}, {"types", "UInt8"}}));
  EXPECT_EQ(vtk.counts["Points"], mesh.points.size());
  EXPECT_EQ(vtk.counts["Cells"], mesh.tets.size());
  EXPECT_THAT(as<Point>(vtk.arrays["Points"]), ::testing::ElementsAreArray(mesh.points));
  EXPECT_THAT(as<Surface>(vtk.arrays["surface"]), ::testing::ElementsAreArray(mesh.surface));
  EXPECT_EQ(vtk.arrays["types"], std::string(mesh.tets.size(), 10));
  const auto corners = as<std::int64_t>(vtk.arrays["connectivity"]), ends = as<std::int64_t>(vtk.arrays["offsets"]);
  ASSERT_EQ(corners.size(), 4 * mesh.tets.size());
  ASSERT_EQ(ends.size(), mesh.tets.size());
  for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
    EXPECT_EQ(ends[i], std::int64_t(4 * i + 4));
    for (std::size_t c = 0; c < 4; ++c) ASSERT_EQ(corners[4 * i + c], mesh.tets[i][c]);
  }
}

TEST(MeshWriter, EverySurfaceFormatHoldsTheClosedHullAndNoOtherPoint) {
  const TempDir folder;
  const std::uint32_t n = 4;
  const auto mesh = block(n, 5);
  for (const auto& [name, format] : kSurfaceFormats) {
    SCOPED_TRACE(name);
    const auto written = write_mesh(folder / name, mesh);
    ASSERT_TRUE(written) << written.error().message;
    const auto read = format.first(folder / name);
    EXPECT_EQ(read.triangles.size(), 6 * n * n * 2);
    EXPECT_EQ(read.points.size(), (n + 1) * (n + 1) * (n + 1) - (n - 1) * (n - 1) * (n - 1));
    EXPECT_TRUE(read.closed());
    EXPECT_NEAR(read.volume(), volume_of(mesh), format.second * volume_of(mesh));
    for (std::size_t i = 0; i < read.surface.size(); ++i) {
      const auto original = std::find(mesh.points.begin(), mesh.points.end(), read.points[i]);
      ASSERT_NE(original, mesh.points.end());
      EXPECT_EQ(read.surface[i], static_cast<std::uint8_t>(mesh.surface[static_cast<std::size_t>(original - mesh.points.begin())]));
    }
  }
}

TEST(MeshWriter, GlbBoundsAreThoseOfItsPositions) {
  const TempDir folder;
  ASSERT_TRUE(write_mesh(folder / "m.glb", block(3, 9)));
  std::string document;
  const auto read = read_glb(folder / "m.glb", &document);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax_element(read.points.begin(), read.points.end(), [&](const Point& a, const Point& b) { return a[axis] < b[axis]; });
    const auto bound = [&](const std::string& name) {
      std::istringstream numbers(between(document, "\"" + name + "\":[", ']').at(0));
      std::string number;
      for (std::size_t i = 0; i <= axis; ++i) std::getline(numbers, number, ',');
      return std::stod(number);
    };
    EXPECT_EQ(bound("min"), (*low)[axis]);
    EXPECT_EQ(bound("max"), (*high)[axis]);
  }
}

TEST(MeshWriter, AnEmptyMeshIsAValidEmptyFile) {
  const TempDir folder;
  ASSERT_TRUE(write_mesh(folder / "m.vtu", Mesh{}));
  auto vtk = read_vtk(folder / "m.vtu");
  EXPECT_EQ(vtk.counts["Points"], 0U);
  EXPECT_EQ(vtk.arrays.size(), 5U);
  for (const auto& [name, format] : kSurfaceFormats) {
    SCOPED_TRACE(name);
    ASSERT_TRUE(write_mesh(folder / name, Mesh{}));
    const auto read = format.first(folder / name);
    EXPECT_TRUE(read.points.empty());
    EXPECT_TRUE(read.triangles.empty());
  }
  EXPECT_EQ(contents_of(folder / "m.glb").find("accessors"), std::string::npos);
}

TEST(MeshWriter, TheExtensionDecidesWhateverItsCase) {
  const TempDir folder;
  for (const char* good : {"a.vtu", "a.VTP", "a.Ply", "a.stl", "a.OBJ", "a.glb"}) EXPECT_TRUE(check_mesh_path(folder / good)) << good;
  for (const char* bad : {"a", "a.vtk", "a.", ".vtu", "a.vtu.gz"}) {
    const auto checked = check_mesh_path(folder / bad);
    ASSERT_FALSE(checked) << bad;
    EXPECT_TRUE(checked.error().usage);
    EXPECT_NE(checked.error().message.find(".vtu"), std::string::npos);
    EXPECT_FALSE(write_mesh(folder / bad, Mesh{}));
  }
}

TEST(MeshWriter, AFullDiskIsAnErrorAndLeavesNothing) {
  const TempDir folder;
  for (const char* extension : {".vtu", ".vtp", ".ply", ".stl", ".obj", ".glb"}) {
    std::filesystem::create_symlink("/dev/full", folder / (std::string("m") + extension));
    const auto written = write_mesh(folder / (std::string("m") + extension), block(2, 1));
    ASSERT_FALSE(written) << extension;
    EXPECT_NE(written.error().message.find("No space left on device"), std::string::npos) << written.error().message;
  }
}

Mesh tetrahedron_with(double coordinate) {
  return {{{0, 0, 0}, {coordinate, 0, 0}, {0, 1, 0}, {0, 0, 1}}, MeshArray<Surface>(4, Surface::inside), {{0, 1, 2, 3}}};
}

TEST(MeshWriter, NoFormatHoldsCoordinatesThatAreNotFinite) {
  const TempDir folder;
  for (const char* name : {"m.vtu", "m.vtp", "m.ply", "m.stl", "m.obj", "m.glb"})
    for (const double coordinate : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
      const auto written = write_mesh(folder / name, tetrahedron_with(coordinate));
      ASSERT_FALSE(written) << name;
      EXPECT_EQ(written.error().message, "cannot write '" + (folder / name).string() + "': a coordinate is not finite");
      EXPECT_FALSE(std::filesystem::exists(folder / name));
    }
}

TEST(MeshWriter, StlAndGlbRefuseCoordinatesBeyondFloats) {
  const TempDir folder;
  for (const char* name : {"m.vtu", "m.vtp", "m.ply", "m.obj"}) EXPECT_TRUE(write_mesh(folder / name, tetrahedron_with(1e300))) << name;
  for (const char* name : {"m.stl", "m.glb"}) {
    EXPECT_FALSE(write_mesh(folder / name, tetrahedron_with(1e300))) << name;
    EXPECT_FALSE(std::filesystem::exists(folder / name));
  }
}

TEST(MeshWriter, ASinkGetsTheBytesOfTheFile) {
  const TempDir folder;
  const auto mesh = block(3, 4);
  for (const char* name : {"m.vtu", "m.vtp", "m.ply", "m.stl", "m.obj", "m.glb"}) {
    std::string bytes;
    ASSERT_TRUE(write_mesh(name, mesh, [&](std::span<const std::byte> more) -> Result<void> {
      bytes.append(reinterpret_cast<const char*>(more.data()), more.size());
      return {};
    }));
    ASSERT_TRUE(write_mesh(folder / name, mesh));
    EXPECT_EQ(bytes, contents_of(folder / name)) << name;
  }
}

TEST(MeshWriter, TheErrorOfASinkIsTheErrorOfTheWriter) {
  for (const char* name : {"m.vtu", "m.glb"}) {
    const auto written = write_mesh(name, block(2, 1), [](std::span<const std::byte>) -> Result<void> { return fail("the sink is full"); });
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().message, "the sink is full");
  }
}

}  // namespace
}  // namespace intervale
