// Diamonds of longest-edge bisection, by arithmetic on their centres.
//
// Kenneth Weiss and Leila De Floriani, "Multiresolution Interval Volume Meshes", 2008, sections 4 and 5.
//
// Vertices are integers in [0, 2^N]^3. A diamond is all tetrahedra that share one longest edge, the spine; its centre
// is the midpoint of the spine. Every vertex but the 8 corners is the centre of exactly one diamond. Scale, class and
// type follow from the bits of the centre. The vertices, parents and children are offsets from the centre: the type's
// row of one table, times h = 2^scale. The compiler computes the 56 rows from the rule in diamond.cpp.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace intervale {

inline constexpr int kRootVertices = 8;
inline constexpr int kMaxLevels = 20;  // N at most

struct Vertex {
  std::int32_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Vertex&, const Vertex&) = default;
};

// An offset from a diamond's centre, in units of h = 2^scale (of h / 2 to the children of a class 2 diamond).
struct Offset {
  std::int8_t x = 0, y = 0, z = 0;
  friend constexpr bool operator==(const Offset&, const Offset&) = default;
};

// c + h * f
[[nodiscard]] constexpr Vertex at(Vertex c, Offset f, std::int32_t h) { return {c.x + f.x * h, c.y + f.y * h, c.z + f.z * h}; }

// Fewest trailing zero bits of a coordinate. N or more for a corner, which is no diamond's centre; 32 for (0, 0, 0).
[[nodiscard]] constexpr int scale_of(Vertex c) { return std::countr_zero(std::uint32_t(c.x | c.y | c.z)); }

// The type: bits scale and scale + 1 of x, y and z, x lowest; in [0, 64), and one of 56 for a centre.
[[nodiscard]] constexpr unsigned type_of(Vertex c, int scale) {
  const auto two = [scale](std::int32_t v) { return unsigned(v >> scale) & 3u; };
  return two(c.x) | two(c.y) << 2 | two(c.z) << 4;
}

// Local numbers. Vertices: 0 and 1 the spine's ends, 2.. the belt in ring order, kCentre the centre. Tetrahedron i:
// both ends of the spine, belt i, belt i + 1 (the last wraps around). Edges, for n belt vertices: 0 the spine, 1 + i
// from end 0 to belt i, 1 + n + i from end 1 to belt i, 1 + 2n + i from belt i to belt i + 1; kSubdivision + v from the
// centre to vertex v, which come into being when the diamond is split.
inline constexpr int kMaxVertices = 10, kMaxTets = 8, kMaxEdges = 25, kMaxChildren = 8, kMaxParents = 4;
inline constexpr int kCentre = kMaxVertices, kSubdivision = kMaxEdges;

// One tetrahedron for the table of cases (tet_cases.h): its vertices in lexicographic order of their coordinates.
struct TetShape {
  std::array<std::uint8_t, 4> vertex{};  // local vertices, ascending by (x, y, z)
  std::array<std::uint8_t, 6> edge{};    // local edges between the pairs 01 02 03 12 13 23 of those
  // How the midpoints of its edges lie among its vertices; see tet_order in tet_cases.h
  std::uint8_t order = 0;
  bool flip = false;  // whether those four, so ordered, are negatively oriented
};

// What splitting a diamond hands to one child: one or, inside the domain, two tetrahedra that share the child's spine
// and the parent's centre (paper, figure 5).
struct Duet {
  Offset child;  // from the parent's centre; in units of h, or of h / 2 for a parent of class 2
  struct Half {
    std::uint8_t tet = 0;  // the tetrahedron that is halved
    std::uint8_t end = 0;  // the spine's end that stays, 0 or 1; the centre replaces the other one
  };
  std::array<Half, 2> half{};
};

struct DiamondType {
  // 0, 1 or 2: the number of coordinates whose bit `scale` is clear; 3 for the 8 numbers that are not types
  std::uint8_t cls = 0;
  std::uint8_t belt = 0, vertices = 0, tets = 0, edges = 0, children = 0, parents = 0;
  std::array<Offset, kMaxVertices> vertex{};  // units of h
  std::array<Offset, kMaxParents> parent{};   // units of h
  std::array<Duet, kMaxChildren> child{};
  std::array<TetShape, kMaxTets> shape{};                           // of each tetrahedron
  std::array<std::array<TetShape, 2>, kMaxTets> half_shape{};       // of its two halves: [tet][end that stays]
  std::array<std::uint32_t, kMaxTets> tet_vertices{}, tet_edges{};  // of each tetrahedron, a bit each
  // By axis: tetrahedra with a vertex below the centre, and above it
  std::array<std::array<std::uint32_t, 2>, 3> beyond{};
  [[nodiscard]] constexpr std::array<std::uint8_t, 4> tet(int i) const {  // local vertices
    return {0, 1, std::uint8_t(2 + i), std::uint8_t(2 + (i + 1) % belt)};
  }
};

// Row `type` of the table, type in [0, 64).
extern const std::array<DiamondType, 64> kDiamondTypes;
[[nodiscard]] inline const DiamondType& diamond_type(unsigned type) { return kDiamondTypes[type]; }

// A diamond: its centre, and what follows from that.
struct Diamond {
  explicit Diamond(Vertex c) : centre(c), scale(scale_of(c)), h(std::int32_t(1) << scale), type(type_of(c, scale)), row(&diamond_type(type)) {}
  // The same, for a centre whose scale and type are known.
  Diamond(Vertex c, int scale_of_c, unsigned type_of_c)
      : centre(c), scale(scale_of_c), h(std::int32_t(1) << scale), type(type_of_c), row(&diamond_type(type)) {}
  Vertex centre;
  int scale;
  std::int32_t h;
  unsigned type;
  const DiamondType* row;

  [[nodiscard]] Vertex vertex(int i) const { return i == kCentre ? centre : at(centre, row->vertex[i], h); }
  [[nodiscard]] Vertex parent(int i) const { return at(centre, row->parent[i], h); }
  [[nodiscard]] bool has_children() const { return row->cls != 2 || h > 1; }
  // Only if has_children().
  [[nodiscard]] Vertex child(int i) const { return at(centre, row->child[i].child, row->cls == 2 ? h / 2 : h); }
};

// Local edge between two local vertices of a diamond with `belt` belt vertices; an edge must join them.
[[nodiscard]] constexpr int edge_between(int a, int b, int belt) {
  if (a > b) {
    const int t = a;
    a = b;
    b = t;
  }
  if (b == kCentre) return kSubdivision + a;
  if (b == 1) return 0;
  if (a == 0) return 1 + (b - 2);
  if (a == 1) return 1 + belt + (b - 2);
  return 1 + 2 * belt + (b - a == 1 ? a - 2 : b - 2);
}

// The two local vertices of a local edge, in the order in which its coefficients run: the centre first on a subdivision
// edge, else the lower number, and belt i before belt i + 1.
[[nodiscard]] constexpr std::array<int, 2> edge_ends(int edge, int belt) {
  if (edge >= kSubdivision) return {kCentre, edge - kSubdivision};
  if (edge == 0) return {0, 1};
  if (edge <= belt) return {0, 2 + edge - 1};
  if (edge <= 2 * belt) return {1, 2 + edge - 1 - belt};
  return {2 + edge - 1 - 2 * belt, 2 + (edge - 2 * belt) % belt};
}

// The shape of a tetrahedron with these vertices (not flat): `local` numbers them within a diamond of `belt` belt
// vertices.
[[nodiscard]] TetShape shape_of(const std::array<Vertex, 4>& position, const std::array<std::uint8_t, 4>& local, int belt);

}  // namespace intervale
