#include "common/mesh_writer.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/mesh_output.h"

namespace intervale {
namespace {

using SurfaceWriter = Result<void> (*)(const std::filesystem::path&, const Mesh&, const BoundaryMesh&);

struct Format {
  const char* extension;
  SurfaceWriter write_surface;  // null: the format holds tetrahedra
};

constexpr std::array<Format, 6> kFormats{{
    {".vtu", nullptr},
    {".vtp", write_vtp},
    {".ply", write_ply},
    {".stl", write_stl},
    {".obj", write_obj},
    {".glb", write_glb},
}};

Result<const Format*> format_of(const std::filesystem::path& path) {
  auto extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  for (const auto& format : kFormats)
    if (extension == format.extension) return &format;
  return misuse("cannot tell the mesh format of '" + path.string() + "': use .vtu (tetrahedra) or .vtp, .ply, .stl, .obj, .glb (boundary triangles)");
}

}  // namespace

Result<void> check_mesh_path(const std::filesystem::path& path) {
  return format_of(path).map([](const Format*) {});
}

Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  const auto format = format_of(path);
  if (!format) return tl::unexpected<Error>(format.error());
  return (*format)->write_surface ? (*format)->write_surface(path, mesh, boundary_mesh(mesh)) : write_vtu(path, mesh);
}

// A. Neumaier, Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen, ZAMM 54, 1974.
double volume_of(const Mesh& mesh) {
  double sum = 0, lost = 0;
  for (const auto& tet : mesh.tets) {
    const auto& origin = mesh.points[tet[0]];
    std::array<std::array<double, 3>, 3> e;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) e[i][axis] = mesh.points[tet[i + 1]][axis] - origin[axis];
    const double six_fold = (e[0][1] * e[1][2] - e[0][2] * e[1][1]) * e[2][0] + (e[0][2] * e[1][0] - e[0][0] * e[1][2]) * e[2][1] +
                            (e[0][0] * e[1][1] - e[0][1] * e[1][0]) * e[2][2];
    const double next = sum + six_fold;
    lost += std::abs(sum) >= std::abs(six_fold) ? (sum - next) + six_fold : (six_fold - next) + sum;
    sum = next;
  }
  return (sum + lost) / 6;
}

}  // namespace intervale
