// The surface formats of the world outside VTK: PLY 1.0, STL and OBJ. See mesh_writer_glb.cpp for glTF.
#include <cstring>
#include <limits>

#include "common/mesh/io/mesh_output.h"

namespace intervale {

void write_ply(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary) {
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
}

void write_stl(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary) {
  if (boundary.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    return out.fail("STL holds at most 4294967295 triangles; write .vtp or .ply");
  std::array<char, 80> title{};  // must not begin with "solid", or readers take the file for text
  std::strcpy(title.data(), "Intervale: boundary of an interval volume");
  out.number(title);
  out.number(static_cast<std::uint32_t>(boundary.triangles.size()));
  for (const auto& triangle : boundary.triangles) {
    const auto& a = mesh.points[boundary.points[triangle[0]]];
    const auto& b = mesh.points[boundary.points[triangle[1]]];
    const auto& c = mesh.points[boundary.points[triangle[2]]];
    out.number(narrowed(normalized(cross(subtract(b, a), subtract(c, a)))));  // 0 for a flat triangle: readers then compute it
    for (const auto& corner : {a, b, c}) out.number(narrowed(corner));
    out.number(std::uint16_t{0});
  }
}

void write_obj(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary) {
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
}

}  // namespace intervale
