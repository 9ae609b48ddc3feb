#include "common/mesh/io/mesh_writer.h"

#include <algorithm>
#include <string>

#include "common/mesh/io/mesh_output.h"

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

}  // namespace intervale
