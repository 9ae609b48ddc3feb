// The skin of a mesh that changes: where the interval volume ends, in pieces, of which only those are made again in which something changed.
//
// A tetrahedron's patch ends at the alpha surface, at the beta surface, or at the box. Each of its faces tells by itself which, if any: three cuts by
// alpha lie on no face that two patches share. So no faces are matched, and what one supercube leaves can be exchanged alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front/front.h"
#include "common/front/front_mesher.h"
#include "common/mesh/normals.h"

namespace intervale {

// As it is drawn. Positions in samples; the normal in world space, of length 127; the level of detail is the scale of the triangles around, 0 the
// finest.
struct SkinVertex {
  float x = 0, y = 0, z = 0;
  std::int8_t nx = 0, ny = 0, nz = 0;
  std::uint8_t level = 0;
};
static_assert(sizeof(SkinVertex) == 16);

// Groups: what lies on alpha, on beta, and on the box.
inline constexpr int kSkinGroups = 3;

struct SkinPiece {
  std::uint32_t id = 0;
  std::vector<SkinVertex> vertices;
  std::vector<std::uint32_t> indices;  // three a triangle, seen from outside counterclockwise; by group
  std::vector<std::uint32_t> edges;    // two an edge, each once in its group; by group
  std::array<std::uint32_t, kSkinGroups> triangles{}, edge_counts{};
  std::array<float, 3> min{}, max{};  // of its vertices
};

class Skin {
 public:
  explicit Skin(const Front& front) : mesher_(front.state()) {}  // which must outlive it

  struct Change {
    bool reset = false;                  // of what was before nothing stays
    std::vector<std::uint32_t> pieces;   // ids of those that are there, and changed
    std::vector<std::uint32_t> removed;  // ids of those in which nothing is left
  };
  // What changed since the last time. O(what changed), and a little for each supercube.
  [[nodiscard]] Change update();
  // The same, but of everything.
  [[nodiscard]] Change all();
  // As of the last update. edges: whether it has its edges. O(its size).
  [[nodiscard]] SkinPiece piece(std::uint32_t id, bool edges);

  // As of the last update.
  [[nodiscard]] std::uint64_t triangles() const { return triangles_; }
  [[nodiscard]] double volume() const;  // of the mesh, world units cubed
  // By how much splits can change that: in each tetrahedron of a diamond that can be split and whose vertices lie on different sides, by all of it
  // that is not in the mesh, or all that is. What lies in diamonds whose vertices are all on one side, unsuspected, is not in it. 0 when all is
  // split.
  [[nodiscard]] double volume_bound() const;
  [[nodiscard]] std::size_t memory_bytes() const;

  // What the mesh is made of, and its points.
  [[nodiscard]] const FrontMesher& mesher() const { return mesher_; }
  [[nodiscard]] const FrontMesher::Position& position(PointId id) const { return position_[id]; }
  [[nodiscard]] Surface surface(PointId id) const { return surface_[id]; }

 private:
  // kind: 0 alpha, 1 beta, 2 + 2 * axis + (1 at the far side) of the box.
  static constexpr int kKinds = 8;
  struct Triangle {
    std::array<PointId, 3> points;
    std::uint8_t kind = 0, level = 0;
  };
  struct Part {  // what a supercube left
    std::uint64_t shown = 0;
    std::uint32_t piece = 0;
    double volume = 0, bound = 0;
    std::vector<Triangle> triangles;
  };

  void forget_all();
  std::vector<std::uint8_t> find_changes();
  void mark_parents(std::size_t number, std::uint64_t slots, std::vector<std::uint8_t>& dirty) const;
  [[nodiscard]] std::uint32_t piece_of(std::size_t number) const;
  void remake(std::size_t number);
  [[nodiscard]] int kind_of(const std::array<PointId, 3>& points, bool at_border) const;
  void add_normals(const std::vector<Triangle>& triangles, int sign);
  [[nodiscard]] bool is_empty(std::uint32_t piece) const;
  [[nodiscard]] double volume_of(const FrontMesher::Tet& tet) const;

  FrontMesher mesher_;
  std::uint64_t point_generation_ = 0;
  std::vector<FrontMesher::Position> position_;  // by PointId
  std::vector<Surface> surface_;
  std::vector<NormalSum> normal_;                    // by name: of the triangles of the point's own surface
  std::vector<std::uint32_t> there_;                 // number of a point's vertex in what is being assembled, if that says so too
  std::vector<Part> parts_;                          // by number of the supercube
  std::vector<std::vector<std::uint32_t>> members_;  // of a piece, by id
  std::vector<std::uint8_t> drawn_;                  // whether a piece had triangles, by id
  std::uint64_t triangles_ = 0;
  // Room to work in.
  std::vector<FrontMesher::Point> points_;
  std::vector<FrontMesher::Tet> tets_;
  std::vector<FrontMesher::Half> halves_;
};

}  // namespace intervale
