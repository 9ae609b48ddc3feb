#include "common/patch/tet_cases.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "common/diamond/domain.h"

namespace intervale {
namespace {

struct Patch {
  std::array<Vertex, 4> p;  // vertices in the shape's order
  TetShape shape;
  std::array<Side, 4> side;
  std::map<int, std::array<double, 3>> corner;
};

double det(const std::array<double, 3>& a, const std::array<double, 3>& b, const std::array<double, 3>& c, const std::array<double, 3>& d) {
  double m[3][3];
  for (int k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
  return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
}

// A random tetrahedron with random values; cuts quantised as updates quantise them.
Patch random_patch(std::mt19937& random) {
  Patch patch;
  std::array<Vertex, 4> p;
  do {
    for (Vertex& v : p) v = {int(random() % 9), int(random() % 9), int(random() % 9)};
  } while (!Domain::exists(p));
  patch.shape = shape_of(p, {0, 1, 2, 3}, 8);
  const double width = random() % 3 == 0 ? 0.01 : 1.0 + double(random() % 40);
  const Range range{100, 100 + width};
  std::array<double, 4> f{};
  for (int i = 0; i < 4; ++i) {
    const double u = double(random() % 1000) / 1000;
    f[i] = std::array{99.999 - 100 * u, range.beta + 0.001 + 100 * u, 100 + u * width, 50 + 150 * u}[random() % 4];
    patch.p[i] = p[patch.shape.vertex[i]];
    patch.side[i] = side_of(f[i], range);
    patch.corner[i] = {double(patch.p[i].x), double(patch.p[i].y), double(patch.p[i].z)};
  }
  for (int a = 0, e = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b, ++e) {
      const bool backwards = random() % 2 != 0;
      const Cuts cuts = backwards ? cuts_between(f[b], f[a], range) : cuts_between(f[a], f[b], range);
      int n = 0;
      for (int surface = 0; surface < 2; ++surface) {
        if (!(surface == 0 ? alpha_cuts(patch.side[a], patch.side[b]) : beta_cuts(patch.side[a], patch.side[b]))) continue;
        double t = (cuts.q[n++] + 0.5) / 256;
        if (backwards) t = 1 - t;
        for (int k = 0; k < 3; ++k) patch.corner[4 + 2 * e + surface][k] = patch.corner[a][k] * (1 - t) + patch.corner[b][k] * t;
      }
    }
  }
  return patch;
}

std::span<const std::array<PatchCorner, 4>> tets(const Patch& p) {
  return tet_cases().tets(p.shape.order, tet_sides(p.side[0], p.side[1], p.side[2], p.side[3]));
}

TEST(TetCases, ThereAre15ByCounts) {
  std::map<std::array<int, 3>, std::set<std::size_t>> sizes;
  for (int i = 0; i < 81; ++i) {
    const Side s[4] = {Side(i % 3), Side(i / 3 % 3), Side(i / 9 % 3), Side(i / 27)};
    std::array<int, 3> counts{};
    for (Side x : s) ++counts[int(x)];
    sizes[counts].insert(tet_cases().count(0, tet_sides(s[0], s[1], s[2], s[3])));
  }
  EXPECT_EQ(sizes.size(), 15u);
  EXPECT_EQ((sizes[{4, 0, 0}]), (std::set<std::size_t>{0}));
  EXPECT_EQ((sizes[{0, 0, 4}]), (std::set<std::size_t>{0}));
  EXPECT_EQ((sizes[{0, 4, 0}]), (std::set<std::size_t>{1}));
  EXPECT_EQ((sizes[{3, 1, 0}]), (std::set<std::size_t>{1}));
  EXPECT_EQ((sizes[{1, 3, 0}]), (std::set<std::size_t>{3}));
}

TEST(TetCases, EveryTetrahedronIsPositiveWhateverTheCuts) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    for (int i = 0; i < 10000; ++i) {
      const Patch p = random_patch(random);
      for (const auto& t : tets(p)) {
        const double d = det(p.corner.at(t[0]), p.corner.at(t[1]), p.corner.at(t[2]), p.corner.at(t[3]));
        ASSERT_GT(p.shape.flip ? -d : d, 0) << "seed " << seed << ", patch " << i;
      }
    }
  }
}

// Each triangle of the patch is in two of its tetrahedra, or lies in a face of the tetrahedron or on one of the
// surfaces.
TEST(TetCases, APatchIsClosed) {
  std::mt19937 random(7);
  for (int i = 0; i < 20000; ++i) {
    const Patch p = random_patch(random);
    std::map<std::set<int>, int> faces;
    for (const auto& t : tets(p)) {
      for (int skip = 0; skip < 4; ++skip) {
        std::set<int> f;
        for (int k = 0; k < 4; ++k) {
          if (k != skip) f.insert(t[k]);
        }
        ++faces[f];
      }
    }
    constexpr int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    for (const auto& [f, n] : faces) {
      ASSERT_LE(n, 2);
      if (n == 2) continue;
      bool on_surface[2] = {true, true};
      int shared = 15;  // tetrahedron faces, by the vertex left out, that hold all three corners
      for (int c : f) {
        for (int s = 0; s < 2; ++s) on_surface[s] = on_surface[s] && c >= 4 && (c - 4) % 2 == s;
        for (int out = 0; out < 4; ++out) {
          if (c < 4 ? c == out : ends[(c - 4) / 2][0] == out || ends[(c - 4) / 2][1] == out) shared &= ~(1 << out);
        }
      }
      ASSERT_TRUE(on_surface[0] || on_surface[1] || shared != 0) << "an inner face stands open";
    }
  }
}

// Two tetrahedra that share a face split it alike: the triangles in the face are the same seen from both.
TEST(TetCases, NeighboursSplitTheirCommonFaceAlike) {
  std::mt19937 random(11);
  constexpr int ends[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  for (int i = 0; i < 20000; ++i) {
    std::array<Vertex, 5> v;
    std::array<Vertex, 4> a, b;
    do {
      for (Vertex& x : v) x = {int(random() % 7), int(random() % 7), int(random() % 7)};
      a = {v[0], v[1], v[2], v[3]};
      b = {v[0], v[1], v[2], v[4]};
    } while (!Domain::exists(a) || !Domain::exists(b));
    std::array<Side, 5> side{};
    for (Side& s : side) s = Side(random() % 3);
    using Name = std::array<int, 3>;  // two vertices and a surface
    const auto face_of = [&](const std::array<Vertex, 4>& p, int fifth) {
      const TetShape shape = shape_of(p, {0, 1, 2, 3}, 8);
      const auto global = [&](int k) { return shape.vertex[k] == 3 ? fifth : int(shape.vertex[k]); };
      std::set<std::set<Name>> triangles;
      for (const auto& t : tet_cases().tets(shape.order, tet_sides(side[global(0)], side[global(1)], side[global(2)], side[global(3)]))) {
        for (int skip = 0; skip < 4; ++skip) {
          std::set<Name> f;
          bool in_face = true;
          for (int k = 0; k < 4; ++k) {
            if (k == skip) continue;
            const int c = t[k], x = global(c < 4 ? c : ends[(c - 4) / 2][0]), y = global(c < 4 ? c : ends[(c - 4) / 2][1]);
            in_face = in_face && x != fifth && y != fifth;
            f.insert({std::min(x, y), std::max(x, y), c < 4 ? 0 : 1 + (c - 4) % 2});
          }
          if (in_face) triangles.insert(f);
        }
      }
      return triangles;
    };
    ASSERT_EQ(face_of(a, 3), face_of(b, 4)) << "trial " << i;
  }
}

}  // namespace
}  // namespace intervale
