// VTK's XML files, format version 1.0 (The VTK User's Guide, 11th edition, "XML File Formats"). Every array lies within
// its DataArray element: zlib's blocks behind a table of their sizes, both in base64. Appended arrays would need
// neither base64 nor memory for the compressed array, but Debian 12's ParaView (5.11.0 with libexpat 2.5.0) cannot read
// them (VTK issue 19258).
#include <zlib.h>

#include <algorithm>
#include <string>
#include <string_view>

#include "common/mesh/io/mesh_output.h"

namespace intervale {
namespace {

constexpr int kTetraCell = 10;               // VTK_TETRA
constexpr std::size_t kBlockBytes = 32'768;  // uncompressed; as in VTK's own files
constexpr int kLevel = 1;                    // of zlib: 6 makes files 7 % smaller and takes three times as long

// RFC 4648, section 4, with padding.
void write_base64(MeshOutput& out, std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<char, 4096> text;
  std::size_t size = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) { return i + k < bytes.size() ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0; };
    const std::uint32_t group = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t digit = 0; digit < 4; ++digit) text[size++] = i + digit > bytes.size() ? '=' : kDigits[group >> (18 - 6 * digit) & 63];
    if (size == text.size()) out.text({text.data(), std::exchange(size, 0)});
  }
  out.text({text.data(), size});
}

// Writes item_at(0) to item_at(count - 1) as an element with these attributes. Holds the compressed array in memory:
// the table of its blocks' sizes comes first, and the file is written from front to back.
template <class ItemAt>
void write_array(MeshOutput& out, const std::string& attributes, std::uint64_t count, ItemAt item_at) {
  using Item = decltype(item_at(0));
  constexpr std::uint64_t kItems = kBlockBytes / sizeof(Item);
  // The number of blocks; the bytes of a whole block; those of the last one, or 0 where it is whole too; then each
  // block's compressed bytes.
  std::vector<std::uint64_t> table{(count + kItems - 1) / kItems, kItems * sizeof(Item), count % kItems * sizeof(Item)};
  std::vector<Bytef> compressed;
  std::vector<Item> block;
  for (std::uint64_t first = 0; first < count; first += kItems) {
    block.clear();
    for (std::uint64_t i = first; i < std::min(first + kItems, count); ++i) block.push_back(item_at(i));
    const auto bytes = static_cast<uLong>(block.size() * sizeof(Item));
    const auto begin = compressed.size();
    uLongf size = compressBound(bytes);
    compressed.resize(begin + size);
    if (compress2(compressed.data() + begin, &size, reinterpret_cast<const Bytef*>(block.data()), bytes, kLevel) != Z_OK)
      return out.fail("not enough memory to compress the mesh");
    compressed.resize(begin + size);
    table.push_back(size);
  }
  out.text("<DataArray " + attributes + " format=\"binary\">");
  write_base64(out, std::as_bytes(std::span(table)));
  write_base64(out, std::as_bytes(std::span(compressed)));
  out.text("</DataArray>\n");
}

// A text as the value of an attribute.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

// The file up to its cells; point_at(i) is the index in mesh.points of the file's point i.
template <class PointAt>
void write_head(MeshOutput& out, const std::string& kind, const std::string& cell_counts, const Mesh& mesh, std::uint64_t points, PointAt point_at) {
  out.text("<?xml version=\"1.0\"?>\n<VTKFile type=\"" + kind +
           "\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<" + kind +
           ">\n<Piece NumberOfPoints=\"" + std::to_string(points) + "\" " + cell_counts + ">\n<PointData Scalars=\"surface\">\n");
  write_array(out, R"(type="UInt8" Name="surface")", points, [&](std::uint64_t i) { return mesh.surface[point_at(i)]; });
  if (!mesh.value.empty()) write_array(out, R"(type="Float64" Name="value")", points, [&](std::uint64_t i) { return mesh.value[point_at(i)]; });
  for (const PointArray& channel : mesh.channels) {
    const unsigned n = channel.components;
    const std::string attributes = "type=\"Float64\" Name=\"" + escaped(channel.name) + "\" NumberOfComponents=\"" + std::to_string(n) + "\"";
    write_array(out, attributes, points * n, [&](std::uint64_t i) { return channel.value[point_at(i / n) * n + i % n]; });
  }
  out.text("</PointData>\n<Points>\n");
  write_array(out, R"(type="Float64" Name="Points" NumberOfComponents="3")", points, [&](std::uint64_t i) { return mesh.points[point_at(i)]; });
  out.text("</Points>\n");
}

// The corners of all cells, and where each cell's end.
template <class Cells>
void write_cells(MeshOutput& out, const Cells& cells) {
  constexpr std::size_t kCorners = std::tuple_size_v<typename Cells::value_type>;
  write_array(out, R"(type="Int64" Name="connectivity")", cells.size() * kCorners,
              [&](std::uint64_t i) { return std::int64_t{cells[i / kCorners][i % kCorners]}; });
  write_array(out, R"(type="Int64" Name="offsets")", cells.size(), [](std::uint64_t i) { return static_cast<std::int64_t>(kCorners * (i + 1)); });
}

}  // namespace

void write_vtu(MeshOutput& out, const Mesh& mesh) {
  write_head(out, "UnstructuredGrid", "NumberOfCells=\"" + std::to_string(mesh.tets.size()) + "\"", mesh, mesh.points.size(),
             [](std::uint64_t i) { return i; });
  out.text("<Cells>\n");
  write_cells(out, mesh.tets);
  write_array(out, R"(type="UInt8" Name="types")", mesh.tets.size(), [](std::uint64_t) { return std::uint8_t{kTetraCell}; });
  out.text("</Cells>\n");
  if (!mesh.part.empty()) {
    out.text("<CellData Scalars=\"range\">\n");
    write_array(out, R"(type="UInt8" Name="range")", mesh.part.size(), [&](std::uint64_t i) { return mesh.part[i]; });
    out.text("</CellData>\n");
  }
  out.text("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
}

void write_vtp(MeshOutput& out, const Mesh& mesh, const BoundaryMesh& boundary) {
  const auto polys =
      "NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(boundary.triangles.size()) + "\"";
  write_head(out, "PolyData", polys, mesh, boundary.points.size(), [&](std::uint64_t i) { return boundary.points[i]; });
  out.text("<Polys>\n");
  write_cells(out, boundary.triangles);
  out.text("</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n");
}

}  // namespace intervale
