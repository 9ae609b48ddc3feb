// A piece of a boundary surface as it is drawn: its triangles by group, its vertices, and its edges.
#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

// Appends the edges of triangles, each once; returns how many.
std::size_t add_edges(std::span<const std::uint32_t> triangles, std::vector<std::uint32_t>& edges) {
  std::vector<std::uint64_t> pairs;
  pairs.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); i += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[i + k], triangles[i + (k + 1) % 3]);
      pairs.push_back(std::uint64_t(low) << 32 | high);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  for (const std::uint64_t pair : pairs) {
    edges.push_back(std::uint32_t(pair >> 32));
    edges.push_back(std::uint32_t(pair));
  }
  return pairs.size();
}

}  // namespace

// Appends a piece's triangles of one kind, and vertices for them with nothing but their level of detail.
void BoundarySurface::add_triangles(std::size_t kind, SurfacePiece& piece) {
  const std::size_t first = piece.points.size();  // of this kind's vertices
  for (const std::uint32_t member : members_[piece.id]) {
    const auto lod = std::uint8_t(mesher_.block(member).scale);
    for (const Triangle& t : parts_[member].of_kind(kind)) {
      for (const PointId point : t) {
        // A sparse set (Briggs and Torczon 1993): vertex_of_ is not cleared; its entry counts if that vertex is this
        // point's.
        std::uint32_t& number = vertex_of_[point];
        if (number < first || number >= piece.points.size() || piece.points[number] != point) {
          number = std::uint32_t(piece.points.size());
          piece.points.push_back(point);
          piece.vertices.emplace_back().lod = lod;
        }
        piece.indices.push_back(number);
        auto& finest = piece.vertices[number].lod;
        finest = std::min(finest, lod);
      }
    }
  }
}

// The positions and normals of a piece's vertices from the given one on, which are all of one kind.
void BoundarySurface::set_vertices(std::size_t kind, std::size_t first, SurfacePiece& piece) const {
  Vec3 of_side{};
  if (kind >= kBox) of_side = scaled((kind - kBox) % 2 == 0 ? -1 : 1, box_normals_[(kind - kBox) / 2]);
  VectorLanes<float> vectors{};
  VectorLanes<std::int8_t> normals{};
  for (; first < piece.vertices.size(); first += kLanes) {
    const std::size_t count = std::min(kLanes, piece.vertices.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      const Point& point = points_[piece.points[first + i]];
      SurfaceVertex& v = piece.vertices[first + i];
      v.x = float(point.position[0]) / FrontMesher::kSteps;
      v.y = float(point.position[1]) / FrontMesher::kSteps;
      v.z = float(point.position[2]) / FrontMesher::kSteps;
      for (std::size_t axis = 0; axis < 3; ++axis) vectors[axis][i] = kind >= kBox ? float(of_side[axis]) : float(point.normal[axis]);
    }
    make_unit_normals(vectors, normals);
    for (std::size_t i = 0; i < count; ++i) {
      SurfaceVertex& v = piece.vertices[first + i];
      v.nx = normals[0][i];
      v.ny = normals[1][i];
      v.nz = normals[2][i];
    }
  }
}

SurfacePiece BoundarySurface::piece(std::uint32_t id, bool edges) {
  SurfacePiece piece;
  piece.id = id;
  std::size_t triangles = 0;
  for (const std::uint32_t member : members_[id]) triangles += parts_[member].triangles.size();
  piece.points.reserve(triangles);  // about one for two triangles
  piece.vertices.reserve(triangles);
  piece.indices.reserve(3 * triangles);
  for (std::size_t kind = 0; kind < kKinds; ++kind) {
    const std::size_t group = std::min(kind, kBox), first = piece.indices.size(), first_vertex = piece.vertices.size();
    add_triangles(kind, piece);
    set_vertices(kind, first_vertex, piece);
    piece.triangles[group] += std::uint32_t((piece.indices.size() - first) / 3);
    if (edges) piece.edge_counts[group] += std::uint32_t(add_edges(std::span(piece.indices).subspan(first), piece.edges));
  }
  if (piece.vertices.empty()) return piece;
  piece.min = piece.max = {piece.vertices[0].x, piece.vertices[0].y, piece.vertices[0].z};
  for (const SurfaceVertex& v : piece.vertices) {
    const std::array<float, 3> p{v.x, v.y, v.z};
    for (std::size_t i = 0; i < 3; ++i) {
      piece.min[i] = std::min(piece.min[i], p[i]);
      piece.max[i] = std::max(piece.max[i], p[i]);
    }
  }
  return piece;
}

}  // namespace intervale
