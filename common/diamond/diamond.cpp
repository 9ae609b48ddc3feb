// The 56 types of diamonds, from one rule (paper, section 5; the offsets are those of the recursive bisection, which
// the tests repeat).
#include "common/diamond/diamond.h"

#include "common/util/vec3.h"

namespace intervale {
namespace {

using Int3 = std::array<int, 3>;

constexpr Offset offset(const Int3& v) { return {std::int8_t(v[0]), std::int8_t(v[1]), std::int8_t(v[2])}; }
constexpr Int3 int3(Offset f) { return {f.x, f.y, f.z}; }

// The vector with these components along three axes.
constexpr Int3 along(const Int3& axes, const Int3& components) {
  Int3 v{};
  for (int i = 0; i < 3; ++i) v[axes[i]] = components[i];
  return v;
}

// The shape of a tetrahedron that is not flat. T holds cubes of coordinate differences.
template <class T>
constexpr TetShape shape(std::array<std::array<T, 3>, 4> p, std::array<std::uint8_t, 4> local, int belt) {
  TetShape s;
  for (int i = 1; i < 4; ++i) {
    for (int j = i; j > 0 && p[j] < p[j - 1]; --j) {
      std::swap(p[j], p[j - 1]);
      std::swap(local[j], local[j - 1]);
    }
  }
  s.vertex = local;
  const auto mid = [&p](int a, int b) { return std::array<T, 3>{p[a][0] + p[b][0], p[a][1] + p[b][1], p[a][2] + p[b][2]}; };
  int e = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) s.edge[e++] = std::uint8_t(edge_between(local[a], local[b], belt));
  }
  // The five comparisons that the order of the vertices leaves open; bit i as listed at tet_order.
  s.order = std::uint8_t((mid(0, 2) < mid(1, 1)) | (mid(0, 3) < mid(1, 1)) << 1 | (mid(0, 3) < mid(1, 2)) << 2 | (mid(0, 3) < mid(2, 2)) << 3 |
                         (mid(1, 3) < mid(2, 2)) << 4);
  s.flip = triple_product(subtract(p[1], p[0]), subtract(p[2], p[0]), subtract(p[3], p[0])) < 0;
  return s;
}

// Vertices, tetrahedra and parents. odd: bit `scale` of each coordinate; g = -1 where the coordinate is 1 modulo 4h, +1
// where it is 3: it points at the neighbour that is 0 modulo 4h.
constexpr DiamondType around(unsigned type) {
  DiamondType t;
  Int3 bits{int(type & 3), int(type >> 2 & 3), int(type >> 4 & 3)}, odd{}, g{};
  int clear = 0;
  for (int i = 0; i < 3; ++i) {
    odd[i] = bits[i] & 1;
    g[i] = odd[i] ? (bits[i] == 1 ? -1 : 1) : 0;
    clear += !odd[i];
  }
  t.cls = std::uint8_t(clear);
  if (clear == 3) return t;
  int n = 0;
  const auto vertex = [&](Int3 v) { t.vertex[n++] = offset(v); };
  if (clear == 0) {
    vertex(g);
    vertex({-g[0], -g[1], -g[2]});
    // The six other corners of the cube: flip one coordinate of the g end, then two, then another one, ...
    for (int i = 0; i < 3; ++i) {
      Int3 v = g;
      v[i] = -v[i];
      t.parent[t.parents++] = offset(v);
      vertex(v);
      v[(i + 1) % 3] = -v[(i + 1) % 3];
      vertex(v);
    }
    t.children = 6;
  } else if (clear == 1) {
    const int e = !odd[0] ? 0 : !odd[1] ? 1 : 2, a = (e + 1) % 3, b = (e + 2) % 3;
    const auto v = [&](int sa, int sb, int se) { return along({a, b, e}, {sa, sb, se}); };
    vertex(v(g[a], g[b], 0));
    vertex(v(-g[a], -g[b], 0));
    vertex(v(g[a], -g[b], 0));
    vertex(v(0, 0, 1));
    vertex(v(-g[a], g[b], 0));
    vertex(v(0, 0, -1));
    t.parent[t.parents++] = offset(v(0, 0, 1));
    t.parent[t.parents++] = offset(v(0, 0, -1));
    t.children = 4;
  } else {
    const int a = odd[0] ? 0 : odd[1] ? 1 : 2, b = (a + 1) % 3, c = (a + 2) % 3;
    const auto v = [&](int sa, int sb, int sc) { return along({a, b, c}, {sa, sb, sc}); };
    vertex(v(-1, 0, 0));
    vertex(v(1, 0, 0));
    constexpr int ring[8][2] = {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}};
    for (const auto& r : ring) {
      vertex(v(0, r[0], r[1]));
      if (r[0] == 0 || r[1] == 0) t.parent[t.parents++] = offset(v(0, r[0], r[1]));
    }
    t.children = 8;
  }
  t.vertices = std::uint8_t(n);
  t.belt = t.tets = std::uint8_t(n - 2);
  t.edges = std::uint8_t(1 + 3 * t.belt);
  for (int i = 0; i < t.tets; ++i) {
    const auto local = t.tet(i);
    for (int a = 0; a < 4; ++a) {
      t.tet_vertices[i] |= 1u << local[a];
      for (int b = a + 1; b < 4; ++b) t.tet_edges[i] |= 1u << edge_between(local[a], local[b], t.belt);
      const Int3 v = int3(t.vertex[local[a]]);
      for (int k = 0; k < 3; ++k) {
        if (v[k] != 0) t.beyond[k][v[k] > 0] |= 1u << i;
      }
    }
  }
  return t;
}

// Positions of local vertices in half units of h, so that they stay whole for the children of class 2.
constexpr Int3 position(const DiamondType& t, int local) {
  if (local == kCentre) return {};
  const Int3 v = int3(t.vertex[local]);
  return {2 * v[0], 2 * v[1], 2 * v[2]};
}

// Adds the half of tetrahedron `tet` that keeps spine end `end` to the duet of the child it belongs to.
constexpr void hand_down(DiamondType& t, int tet, int end, std::array<int, kMaxChildren>& halves, int& children) {
  std::array<std::uint8_t, 4> local = t.tet(tet);
  local[1 - end] = kCentre;
  // The child's spine is the half's longest edge.
  int longest = -1, s0 = 0, s1 = 0;
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) {
      const Int3 d = subtract(position(t, local[a]), position(t, local[b]));
      if (dot(d, d) > longest) longest = dot(d, d), s0 = a, s1 = b;
    }
  }
  const Int3 a = position(t, local[s0]), b = position(t, local[s1]);
  const int unit = t.cls == 2 ? 1 : 2;  // a unit of the child's offsets, in half units of h
  const Int3 centre{(a[0] + b[0]) / (2 * unit), (a[1] + b[1]) / (2 * unit), (a[2] + b[2]) / (2 * unit)};
  int k = 0;
  while (k < children && int3(t.child[k].child) != centre) ++k;
  if (k == children) ++children;
  Duet& duet = t.child[k];
  duet.child = offset(centre);
  duet.half[halves[k]++] = {std::uint8_t(tet), std::uint8_t(end)};
}

constexpr std::array<DiamondType, 64> generate() {
  std::array<DiamondType, 64> all{};
  for (unsigned type = 0; type < 64; ++type) all[type] = around(type);
  for (unsigned type = 0; type < 64; ++type) {
    DiamondType& t = all[type];
    if (t.cls == 3) continue;
    std::array<int, kMaxChildren> halves{};
    int children = 0;
    for (int i = 0; i < t.tets; ++i) {
      for (int end = 0; end < 2; ++end) {
        hand_down(t, i, end, halves, children);
        std::array<std::uint8_t, 4> local = t.tet(i);
        local[1 - end] = kCentre;
        t.half_shape[i][end] =
            shape<int>({position(t, local[0]), position(t, local[1]), position(t, local[2]), position(t, local[3])}, local, t.belt);
      }
      const auto local = t.tet(i);
      t.shape[i] = shape<int>({position(t, local[0]), position(t, local[1]), position(t, local[2]), position(t, local[3])}, local, t.belt);
    }
  }
  return all;
}

}  // namespace

constinit const std::array<DiamondType, 64> kDiamondTypes = generate();

TetShape shape_of(const std::array<Vertex, 4>& position, const std::array<std::uint8_t, 4>& local, int belt) {
  std::array<std::array<std::int64_t, 3>, 4> p{};
  for (int i = 0; i < 4; ++i) p[i] = {position[i].x, position[i].y, position[i].z};
  return shape<std::int64_t>(p, local, belt);
}

}  // namespace intervale
