// The surface formats of the world outside VTK: PLY 1.0, STL and OBJ. See mesh_writer_glb.cpp for glTF.
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "common/mesh/io/mesh_output.h"

namespace intervale {
namespace {

using Vector = std::array<double, 3>;

Vector normal(const Vector& a, const Vector& b, const Vector& c) {
  const Vector u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const Vector n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  if (!(length > 0)) return {0, 0, 0};  // STL's own way to say: take it from the corners
  return {n[0] / length, n[1] / length, n[2] / length};
}

std::array<float, 3> narrowed(const Vector& v) { return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}; }

}  // namespace

Result<void> write_ply(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary) {
  auto created = MeshOutput::create(path);
  if (!created) return tl::unexpected<Error>(created.error());
  auto& out = *created;
  out.text("ply\nformat binary_little_endian 1.0\ncomment surface: 0 inside the range, 1 on alpha, 2 on beta\nelement vertex ");
  out.decimal(boundary.points.size());
  out.text("\nproperty double x\nproperty double y\nproperty double z\nproperty uchar surface\nelement face ");
  out.decimal(boundary.triangles.size());
  // Unsigned indices would be right too, but some readers take only int; they differ above 2^31 points alone.
  out.text("\nproperty list uchar int vertex_indices\nend_header\n");
  for (const auto point : boundary.points) {
    out.number(mesh.points[point]);
    out.number(mesh.surface[point]);
  }
  for (const auto& triangle : boundary.triangles) {
    out.number(std::uint8_t{3});
    out.number(triangle);
  }
  return out.commit();
}

Result<void> write_stl(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary) {
  if (boundary.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    return fail("cannot write '" + path.string() + "': STL holds at most 4294967295 triangles; write .vtp or .ply");
  auto created = MeshOutput::create(path);
  if (!created) return tl::unexpected<Error>(created.error());
  auto& out = *created;
  std::array<char, 80> title{};  // must not begin with "solid", or readers take the file for text
  std::strcpy(title.data(), "Intervale: boundary of an interval volume");
  out.number(title);
  out.number(static_cast<std::uint32_t>(boundary.triangles.size()));
  for (const auto& triangle : boundary.triangles) {
    const auto& a = mesh.points[boundary.points[triangle[0]]];
    const auto& b = mesh.points[boundary.points[triangle[1]]];
    const auto& c = mesh.points[boundary.points[triangle[2]]];
    out.number(narrowed(normal(a, b, c)));
    for (const auto& corner : {a, b, c}) out.number(narrowed(corner));
    out.number(std::uint16_t{0});
  }
  return out.commit();
}

Result<void> write_obj(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary) {
  auto created = MeshOutput::create(path);
  if (!created) return tl::unexpected<Error>(created.error());
  auto& out = *created;
  out.text("# Intervale: boundary of an interval volume\n");
  for (const auto point : boundary.points) {
    out.text("v");
    for (const double coordinate : mesh.points[point]) {
      out.text(" ");
      out.decimal(coordinate);
    }
    out.text("\n");
  }
  for (const auto& triangle : boundary.triangles) {
    out.text("f");
    for (const auto corner : triangle) {
      out.text(" ");
      out.decimal(std::uint64_t{corner} + 1);  // OBJ counts from 1
    }
    out.text("\n");
  }
  return out.commit();
}

}  // namespace intervale
