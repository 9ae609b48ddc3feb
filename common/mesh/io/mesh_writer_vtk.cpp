// VTK's XML files, format version 1.0: a head that names arrays by their offset, then the arrays, raw, each behind its length in bytes.
#include <string>
#include <string_view>

#include "common/mesh/io/mesh_output.h"

namespace intervale {
namespace {

constexpr int kTetraCell = 10;  // VTK_TETRA

// Writes the head's DataArray elements and keeps count of where each array will begin.
class Head {
 public:
  Head(MeshOutput& out, std::string_view kind) : out_(out), kind_(kind) {
    out_.text("<?xml version=\"1.0\"?>\n<VTKFile type=\"");
    out_.text(kind_);
    out_.text("\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<");
    out_.text(kind_);
    out_.text(">\n<Piece");
  }
  void count(std::string_view what, std::uint64_t number) {
    out_.text(" NumberOf");
    out_.text(what);
    out_.text("=\"");
    out_.decimal(number);
    out_.text("\"");
  }
  void text(std::string_view text) { out_.text(text); }
  void array(std::string_view name, std::string_view type, int components, std::uint64_t bytes) {
    out_.text("<DataArray type=\"");
    out_.text(type);
    out_.text("\" Name=\"");
    out_.text(name);
    out_.text("\" NumberOfComponents=\"");
    out_.decimal(components);
    out_.text("\" format=\"appended\" offset=\"");
    out_.decimal(offset_);
    out_.text("\"/>\n");
    offset_ += sizeof(std::uint64_t) + bytes;
  }
  void end() {
    out_.text("</Piece>\n</");
    out_.text(kind_);
    out_.text(">\n<AppendedData encoding=\"raw\">\n_");
  }

 private:
  MeshOutput& out_;
  std::string_view kind_;
  std::uint64_t offset_ = 0;
};

constexpr std::string_view kFoot = "\n</AppendedData>\n</VTKFile>\n";

}  // namespace

Result<void> write_vtu(const std::filesystem::path& path, const Mesh& mesh) {
  auto created = MeshOutput::create(path);
  if (!created) return tl::unexpected<Error>(created.error());
  auto& out = *created;
  const std::uint64_t points = mesh.points.size(), tets = mesh.tets.size();
  const std::uint64_t point_bytes = points * 3 * sizeof(double), corner_bytes = tets * 4 * sizeof(std::int64_t),
                      end_bytes = tets * sizeof(std::int64_t);

  Head head(out, "UnstructuredGrid");
  head.count("Points", points);
  head.count("Cells", tets);
  head.text(">\n<PointData Scalars=\"surface\">\n");
  head.array("surface", "UInt8", 1, points);
  head.text("</PointData>\n<Points>\n");
  head.array("Points", "Float64", 3, point_bytes);
  head.text("</Points>\n<Cells>\n");
  head.array("connectivity", "Int64", 1, corner_bytes);
  head.array("offsets", "Int64", 1, end_bytes);
  head.array("types", "UInt8", 1, tets);
  head.text("</Cells>\n");
  head.end();

  out.number(points);
  out.numbers(mesh.surface);
  out.number(point_bytes);
  out.numbers(mesh.points);
  out.number(corner_bytes);
  for (const auto& tet : mesh.tets) out.number(std::array<std::int64_t, 4>{tet[0], tet[1], tet[2], tet[3]});
  out.number(end_bytes);
  for (std::uint64_t i = 1; i <= tets; ++i) out.number(std::int64_t(4 * i));
  out.number(tets);
  for (std::uint64_t i = 0; i < tets; ++i) out.number(std::uint8_t{kTetraCell});
  out.text(kFoot);
  return out.commit();
}

Result<void> write_vtp(const std::filesystem::path& path, const Mesh& mesh, const BoundaryMesh& boundary) {
  auto created = MeshOutput::create(path);
  if (!created) return tl::unexpected<Error>(created.error());
  auto& out = *created;
  const std::uint64_t points = boundary.points.size(), triangles = boundary.triangles.size();
  const std::uint64_t point_bytes = points * 3 * sizeof(double), corner_bytes = triangles * 3 * sizeof(std::int64_t),
                      end_bytes = triangles * sizeof(std::int64_t);

  Head head(out, "PolyData");
  head.count("Points", points);
  head.count("Verts", 0);
  head.count("Lines", 0);
  head.count("Strips", 0);
  head.count("Polys", triangles);
  head.text(">\n<PointData Scalars=\"surface\">\n");
  head.array("surface", "UInt8", 1, points);
  head.text("</PointData>\n<Points>\n");
  head.array("Points", "Float64", 3, point_bytes);
  head.text("</Points>\n<Polys>\n");
  head.array("connectivity", "Int64", 1, corner_bytes);
  head.array("offsets", "Int64", 1, end_bytes);
  head.text("</Polys>\n");
  head.end();

  out.number(points);
  for (const auto point : boundary.points) out.number(mesh.surface[point]);
  out.number(point_bytes);
  for (const auto point : boundary.points) out.number(mesh.points[point]);
  out.number(corner_bytes);
  for (const auto& t : boundary.triangles) out.number(std::array<std::int64_t, 3>{t[0], t[1], t[2]});
  out.number(end_bytes);
  for (std::uint64_t i = 1; i <= triangles; ++i) out.number(std::int64_t(3 * i));
  out.text(kFoot);
  return out.commit();
}

}  // namespace intervale
