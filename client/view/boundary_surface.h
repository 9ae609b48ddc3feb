// The boundary surface of a mesh that changes: where the interval volume ends. It comes in pieces, and only those are
// remade in which something changed.
//
// A tetrahedron's patch ends at the alpha surface, at the beta surface, or at the box. Each of its faces tells by
// itself which, if any: three cuts by alpha lie on no face that two patches share. So no faces are matched, and what
// one supercube leaves can be exchanged alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/view/corner_normals.h"
#include "common/front/front.h"
#include "common/front/front_mesher.h"
#include "common/mesh/normals.h"
#include "common/view/depth_map.h"

namespace intervale {

// A vertex as it is drawn. Position in samples; normal in world space, of length 127.
struct SurfaceVertex {
  float x = 0, y = 0, z = 0;
  std::int8_t nx = 0, ny = 0, nz = 0;
  std::uint8_t lod = 0;  // level of detail: the finest scale of the triangles at this vertex, 0 the finest of all
};
static_assert(sizeof(SurfaceVertex) == 16);

// Groups of triangles: on the alpha surface, on the beta surface, and on the box.
inline constexpr int kSurfaceGroups = 3;

struct SurfacePiece {
  std::uint32_t id = 0;
  std::vector<SurfaceVertex> vertices;
  std::vector<PointId> points;         // of the mesh, one for each vertex
  std::vector<std::uint32_t> indices;  // three a triangle, counterclockwise from outside in the world; by group
  std::vector<std::uint32_t> edges;    // two an edge, each once in its group; by group
  std::array<std::uint32_t, kSurfaceGroups> triangles{}, edge_counts{};
  std::array<float, 3> min{}, max{};  // bounds of its vertices
};

class BoundarySurface {
 public:
  explicit BoundarySurface(const Front& front);  // which must outlive it

  struct Change {
    bool reset = false;                  // nothing of the former surface stays
    bool is_other_mesh = false;          // tetrahedra changed; perhaps only some inside
    std::vector<std::uint32_t> pieces;   // ids of pieces that exist and changed
    std::vector<std::uint32_t> removed;  // ids of pieces that have become empty
  };
  // What changed since the last update. O(changes), and a little for each supercube. Only the faces on surfaces are
  // visited, not the tetrahedra.
  [[nodiscard]] Change update();
  // Updates, and reports every piece as changed.
  [[nodiscard]] Change all();
  // A piece as of the last update, with or without edges. O(its size).
  [[nodiscard]] SurfacePiece piece(std::uint32_t id, bool edges);

  // Draws what the last update made, as far as it hides anything. O(triangles).
  void draw(DepthBuffer& buffer) const;

  // As of the last update.
  [[nodiscard]] std::uint64_t triangles() const { return triangles_; }
  [[nodiscard]] double volume() const;  // of the mesh, world units cubed
  // How much splits can change that volume: for each tetrahedron of a diamond that can be split and whose vertices lie
  // on different sides, the larger of its part in the mesh and the rest. Surfaces inside diamonds whose vertices all
  // lie on one side are not known and not counted. 0 when everything is split. Visits what was updated since it was
  // last called, for about as long as an update does.
  [[nodiscard]] double volume_bound();

  // What the mesh is made of, and its points.
  [[nodiscard]] const FrontMesher& mesher() const { return mesher_; }
  [[nodiscard]] const FrontMesher::Position& position(PointId id) const { return points_[id].position; }
  [[nodiscard]] Surface surface(PointId id) const;

 private:
  // What a triangle lies on: alpha, beta, or a side of the box: kBox + 2 * axis + (1 at the far side).
  static constexpr std::size_t kAlpha = 0, kBeta = 1, kBox = 2, kKinds = 8;
  using Triangle = std::array<PointId, 3>;  // counterclockwise from outside in the world
  struct Point {
    FrontMesher::Position position{};
    NormalSum normal{};      // of the triangles of the point's own surface
    std::uint8_t kinds = 0;  // what it lies on, a bit each
  };
  struct Part {  // what a supercube left
    std::uint64_t shown = 0;
    std::uint32_t piece = 0;
    bool has_bound = false;
    double volume = 0, bound = 0;
    std::vector<Triangle> triangles;          // by kind
    std::array<std::uint16_t, kKinds> end{};  // of each kind's triangles
    [[nodiscard]] std::span<const Triangle> of_kind(std::size_t kind) const {
      const std::size_t begin = kind == 0 ? 0 : end[kind - 1];
      return std::span(triangles).subspan(begin, end[kind] - begin);
    }
  };
  class NormalAdder;

  [[nodiscard]] double samples_in_world() const;  // the volume of a cube of samples / kSteps, less than 0 if mirrored
  void forget_all();
  std::vector<std::uint8_t> find_changes();
  void mark_parents(std::size_t number, std::uint64_t slots, std::vector<std::uint8_t>& dirty) const;
  [[nodiscard]] std::uint32_t piece_of(std::size_t number) const;
  void find_bound(std::size_t number, Part& part);
  void find_triangles(std::size_t number);
  void find_box_faces(std::size_t number);
  void keep_triangles(Part& part);
  [[nodiscard]] double volume_under(const Part& part) const;
  [[nodiscard]] std::uint8_t kinds_of(const FrontMesher::Point& point, bool is_border) const;
  [[nodiscard]] bool is_at_border(std::size_t number) const;
  void remake(const std::vector<std::uint8_t>& dirty);
  [[nodiscard]] bool is_empty(std::uint32_t piece) const;
  [[nodiscard]] double volume_of(const FrontMesher::Tet& tet) const;
  void add_triangles(std::size_t kind, SurfacePiece& piece);
  void set_vertices(std::size_t kind, std::size_t first, SurfacePiece& piece) const;

  FrontMesher mesher_;
  bool is_mirrored_;                 // what is counterclockwise in samples is not in the world
  std::array<Vec3, 3> box_normals_;  // by axis, in the world: of the box's far side
  std::uint64_t point_generation_ = 0;
  CornerNormals corner_normals_;
  std::vector<Point> points_;                        // by PointId
  std::vector<std::uint32_t> vertex_of_;             // by PointId: its vertex in the piece being assembled, if that vertex has this id
  std::vector<Part> parts_;                          // by number of the supercube
  std::size_t known_ = 0;                            // how many of them the last update saw
  std::vector<std::vector<std::uint32_t>> members_;  // of a piece, by id
  std::vector<std::uint8_t> drawn_;                  // whether a piece had triangles, by id
  std::uint64_t triangles_ = 0;
  // Room to work in.
  std::vector<FrontMesher::Point> mesh_points_;
  FrontMesher::Tets tets_;
  std::vector<FrontMesher::Half> halves_;
  std::vector<FrontMesher::Face> faces_;
  std::array<std::vector<Triangle>, kKinds> found_;  // by kind
};

}  // namespace intervale
