// The front: the unsplit diamonds of a mesh that is being refined and coarsened, and the mesh they make. It needs no field.
//
// Weiss and De Floriani 2008, sections 6 and 7. Every diamond of the front holds the sides of its vertices and the mesh points on its edges;
// splitting it needs only the side of its centre and the cuts on its subdivision edges, and hands each child its duet. Two differences from the
// paper: the diamonds of class 2 with h = 1, whose children never split, keep what splitting brings and make those children's tetrahedra themselves;
// and a mesh point on the far faces of a box that clamps (domain.h) is found by its position, for there two edges can be one.
//
// After any sequence of splits and merges the mesh is conforming and positively oriented, and depends only on which diamonds are split.
#pragma once

#include <array>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/base.h"
#include "common/diamond.h"
#include "common/domain.h"
#include "common/grid.h"
#include "common/mesh.h"
#include "common/prediction.h"
#include "common/tet_cases.h"

namespace intervale {

class Front {
 public:
  // A diamond of the front that can be split now; valid until the next split or merge.
  enum class Handle : std::uint32_t {};

  // The mesh of the root's patch. grid.dims in [kMinSide, kMaxSide].
  Front(const Grid& grid, const Base& base);

  // The diamond with this centre, if it is in the front with all its tetrahedra, is not split and not idle. Any vertex will do, also one that is no
  // centre.
  [[nodiscard]] std::optional<Handle> find(Vertex centre) const;

  // What the diamond knows before its split. Its count_cuts tells how many coefficients splitting takes.
  [[nodiscard]] DiamondContext context(Handle handle) const;

  // Splits a diamond. cuts: q (see Cuts) of each cut on the subdivision edges, centre to vertex, in order of local vertices, alpha before beta:
  // context(handle).count_cuts(side).all of them. Returns the cuts of the spine, from vertex 0 to vertex 1, which merge() needs back.
  Cuts split(Handle handle, Side side, std::span<const std::uint8_t> cuts);

  // Undoes the split of a diamond none of whose children is split. False, and nothing done, if there is no such.
  bool merge(Vertex centre, const Cuts& spine);

  [[nodiscard]] std::uint64_t tet_count() const { return tet_count_; }
  [[nodiscard]] std::size_t diamond_count() const { return diamonds_.size(); }  // in the front, those that made their children's tetrahedra included
  [[nodiscard]] std::size_t memory_bytes() const;

  // Calls sink(std::array<std::uint32_t, 4>) for every tetrahedron, with point numbers below point_limit().
  template <class Sink>
  void for_each_tet(Sink&& sink) const;
  [[nodiscard]] std::size_t point_limit() const { return points_.size(); }

  // The mesh, in world coordinates; points in order of first use.
  [[nodiscard]] Mesh mesh() const;

  // Every invariant that can be checked from inside; the first one that does not hold, as a text. For tests; O(front).
  [[nodiscard]] std::optional<std::string> validate() const;

 private:
  struct Point {  // in 1/512 of a sample: every cut of every edge is whole there
    std::int32_t x, y, z;
    Surface surface;
    friend bool operator==(const Point&, const Point&) = default;
  };
  // A record is a header and point numbers: its vertices', its edges' (the first cut's; a second one follows), and for a split diamond of class 2
  // with h = 1 the centre's and the subdivision edges'.
  struct Header {
    Vertex centre;
    std::uint32_t sides = 0;  // two bits each, by local vertex
    std::uint8_t type = 0;
    std::uint8_t tets = 0;      // those that exist
    std::uint8_t received = 0;  // those whose parent is split
    bool split = false;         // only class 2 with h = 1
    bool straddles = false;     // not all inside the box
  };
  struct Slab {  // records of one size
    unsigned stride = 0;
    std::vector<Header> headers;
    std::vector<std::uint32_t> points;
    std::vector<std::uint32_t> unused;
  };
  struct Record {
    Header* header;
    std::uint32_t* points;
  };
  struct Retired {  // a straddling diamond as it was before its split
    Header header;
    std::array<std::uint32_t, kMaxVertices + kMaxEdges> points{};
  };
  struct PointKey {
    Point first, second;  // equal where there is but one
    friend bool operator==(const PointKey&, const PointKey&) = default;
  };
  struct PointHash {
    std::size_t operator()(const PointKey& k) const {
      std::uint64_t h = 0;
      for (const Point& p : {k.first, k.second}) {
        for (const std::int32_t c : {p.x, p.y, p.z, std::int32_t(p.surface)}) h = (h ^ std::uint32_t(c)) * 0x9e3779b97f4a7c15u;
      }
      return std::size_t(h ^ h >> 32);
    }
  };

  [[nodiscard]] Record record(std::uint32_t handle);
  [[nodiscard]] const Header& header(std::uint32_t handle) const;
  [[nodiscard]] const std::uint32_t* points(std::uint32_t handle) const;
  std::uint32_t obtain(Vertex centre);  // the record of a diamond, made if it is not there
  void release(std::uint32_t handle);
  [[nodiscard]] static Side side(const Header& h, int local) { return Side(h.sides >> (2 * local) & 3); }
  [[nodiscard]] TetShape shape(const Header& h, const DiamondType& row, int tet) const;
  [[nodiscard]] TetShape half_shape(const Header& h, const DiamondType& row, int tet, int end) const;
  [[nodiscard]] bool half_exists(const Header& h, const DiamondType& row, int tet, int end) const;
  [[nodiscard]] bool is_border(Vertex v) const;
  std::uint32_t add_points(const Point* points, int count, bool border);
  std::uint32_t add_cuts(Vertex a, Vertex b, Side from, Side to, const std::uint8_t* q);
  std::uint32_t add_vertex(Vertex v);
  void drop_points(std::uint32_t first, int count, bool border);
  [[nodiscard]] Cuts cuts_of(const Header& h, const DiamondType& row, int edge, std::uint32_t first) const;
  // 2 q + 1 of a point on an edge.
  [[nodiscard]] std::int32_t place_on_edge(const Header& h, const DiamondType& row, int edge, const Point& p) const;
  [[nodiscard]] unsigned count_tets(const Header& h, const DiamondType& row) const;
  [[nodiscard]] unsigned count_halves(const Header& h, const DiamondType& row, Side centre) const;

  Grid grid_;
  Domain domain_;
  std::array<Slab, 4> slabs_;                                         // class 0, 1, 2, and class 2 with h = 1
  boost::unordered_flat_map<std::uint64_t, std::uint32_t> diamonds_;  // DiamondId to handle
  boost::unordered_flat_map<std::uint64_t, Retired> retired_;
  std::vector<Point> points_;
  std::array<std::vector<std::uint32_t>, 2> unused_points_;  // runs of 1 and of 2
  boost::unordered_flat_map<PointKey, std::uint32_t, PointHash> border_points_;
  std::uint64_t tet_count_ = 0;
};

template <class Sink>
void Front::for_each_tet(Sink&& sink) const {
  const TetCases& cases = tet_cases();
  for (const Slab& slab : slabs_) {
    for (std::size_t i = 0; i < slab.headers.size(); ++i) {
      const Header& h = slab.headers[i];
      if (h.received == 0) continue;
      const DiamondType& row = diamond_type(h.type);
      const std::uint32_t* const p = slab.points.data() + i * slab.stride;
      const std::uint32_t* const edge = p + row.vertices;
      const std::uint32_t* const added = edge + row.edges;  // the centre's point, then the subdivision edges'
      const auto emit = [&](const TetShape& s) {
        for (const auto& corners : cases.tets(s.order, shape_sides(s, h.sides))) {
          std::array<std::uint32_t, 4> tet;
          for (int k = 0; k < 4; ++k) {
            const int c = corners[k];
            if (c < 4) {
              const int v = s.vertex[c];
              tet[k] = v == kCentre ? added[0] : p[v];
              continue;
            }
            const int e = s.edge[(c - 4) / 2];
            tet[k] = e >= kSubdivision ? added[1 + e - kSubdivision] : edge[e];
            if ((c & 1) == 1) {  // beta: after alpha, if alpha cuts this edge too
              constexpr int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
              const auto [a, b] = ends[(c - 4) / 2];
              tet[k] += alpha_cuts(side(h, s.vertex[a]), side(h, s.vertex[b]));
            }
          }
          if (s.flip) std::swap(tet[2], tet[3]);
          sink(tet);
        }
      };
      for (int t = 0; t < row.tets; ++t) {
        if (!(h.received >> t & 1)) continue;
        if (!h.split) {
          emit(shape(h, row, t));
        } else {
          for (int end = 0; end < 2; ++end) {
            if (half_exists(h, row, t, end)) emit(half_shape(h, row, t, end));
          }
        }
      }
    }
  }
}

}  // namespace intervale
