#include "common/mesh/io/mesh_writer.h"
#include "common/mesh/boundary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>
#include <string>

#include "tests/support/mesh_readers.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

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

TEST(MeshWriter, VtuAndVtpHoldTheValuesOfThePointsIfThereAreAny) {
  const TempDir folder;
  auto mesh = block(6, 5);
  std::mt19937 random(5);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) mesh.value.push_back(std::ldexp(double(random()), int(random() % 400) - 200));
  for (const char* name : {"m.vtu", "m.vtp"}) {
    ASSERT_TRUE(write_mesh(folder / name, mesh));
    auto vtk = read_vtk(folder / name);
    EXPECT_EQ(vtk.types["value"], "Float64");
    const auto points = as<Point>(vtk.arrays["Points"]);
    const auto values = as<double>(vtk.arrays["value"]);
    ASSERT_EQ(values.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto original = std::find(mesh.points.begin(), mesh.points.end(), points[i]);
      ASSERT_NE(original, mesh.points.end());
      EXPECT_EQ(values[i], mesh.value[static_cast<std::size_t>(original - mesh.points.begin())]);
    }
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
