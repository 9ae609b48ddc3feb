#include "common/mesh/io/mesh_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/mesh/io/mesh_output.h"
#include "common/util/atomic_file.h"

namespace intervale {
namespace {

using SurfaceWriter = void (*)(MeshOutput&, const Mesh&, const BoundaryMesh&);

struct Format {
  const char* extension;
  double largest;               // coordinate, in magnitude
  SurfaceWriter write_surface;  // null: the format holds tetrahedra
};

constexpr double kLargestDouble = std::numeric_limits<double>::max(), kLargestFloat = std::numeric_limits<float>::max();

constexpr std::array<Format, 6> kFormats{{
    {".vtu", kLargestDouble, nullptr},
    {".vtp", kLargestDouble, write_vtp},
    {".ply", kLargestDouble, write_ply},
    {".stl", kLargestFloat, write_stl},
    {".obj", kLargestDouble, write_obj},
    {".glb", kLargestFloat, write_glb},
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

Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh, const ByteSink& sink) {
  const auto format = format_of(path);
  if (!format) return tl::unexpected<Error>(format.error());
  const auto [extension, largest, write_surface] = **format;
  MeshOutput out(path, sink);
  for (const auto& point : mesh.points)
    for (const double coordinate : point)
      if (!(std::abs(coordinate) <= largest)) {  // NaN too
        out.fail(std::isfinite(coordinate) ? "a coordinate is too large for the format's 32-bit floats; write .vtp" : "a coordinate is not finite");
        return out.result();
      }
  if (write_surface)
    write_surface(out, mesh, boundary_mesh(mesh));
  else
    write_vtu(out, mesh);
  return out.result();
}

Result<void> write_mesh(const std::filesystem::path& path, const Mesh& mesh) {
  if (auto checked = check_mesh_path(path); !checked) return checked;
  auto file = AtomicFile::create(path);
  if (!file) return tl::unexpected<Error>(file.error());
  return write_mesh(path, mesh, [&](std::span<const std::byte> bytes) { return file->write(bytes); }).and_then([&] { return file->commit(); });
}

}  // namespace intervale
