#include "common/diamond/diamond.h"

#include <gtest/gtest.h>

#include "tests/support/bisection.h"

namespace intervale {
namespace {

using testing::point;
using testing::sorted;
using testing::Tet;

testing::Point doubled(Vertex v) { return {2 * v.x, 2 * v.y, 2 * v.z}; }
bool inside(Vertex v, int n) { return v.x >= 0 && v.y >= 0 && v.z >= 0 && v.x <= n && v.y <= n && v.z <= n; }

class DiamondTable : public ::testing::TestWithParam<int> {};

TEST_P(DiamondTable, EqualsRecursiveBisection) {
  const int levels = GetParam(), n = 1 << levels;
  const auto naive = testing::bisect(levels);
  std::size_t seen = 0;
  for (const auto& [place, expected] : naive) {
    if (place[0] % 2 != 0 || place[1] % 2 != 0 || place[2] % 2 != 0) continue;  // a leaf of half-integer centre: not in the table
    ++seen;
    const Diamond d({place[0] / 2, place[1] / 2, place[2] / 2});
    ASSERT_LT(d.row->cls, 3);
    std::set<testing::Point> spine{point(d.vertex(0)), point(d.vertex(1))};
    EXPECT_EQ(spine, (std::set<testing::Point>{expected.spine[0], expected.spine[1]}));
    std::set<Tet> tets;
    for (int i = 0; i < d.row->tets; ++i) {
      Tet t{};
      bool exists = true;
      for (int k = 0; k < 4; ++k) {
        const Vertex v = d.vertex(d.row->tet(i)[k]);
        exists = exists && inside(v, n);
        t[k] = point(v);
      }
      if (exists) tets.insert(sorted(t));
    }
    EXPECT_EQ(tets, expected.tets);
    std::set<testing::Point> parents, children;
    for (int i = 0; i < d.row->parents; ++i) {
      const Vertex p = d.parent(i);  // the root's are corners: no diamonds
      const bool corner = p.x % n == 0 && p.y % n == 0 && p.z % n == 0;
      if (inside(p, n) && !corner) parents.insert(doubled(p));
    }
    EXPECT_EQ(parents, expected.parents);
    for (int i = 0; i < d.row->children; ++i) {
      const Offset f = d.row->child[i].child;
      const int unit = d.row->cls == 2 ? d.h : 2 * d.h;  // doubled coordinates
      const testing::Point c{place[0] + f.x * unit, place[1] + f.y * unit, place[2] + f.z * unit};
      if (naive.contains(c) && c[0] >= 0 && c[1] >= 0 && c[2] >= 0) children.insert(c);
    }
    EXPECT_EQ(children, expected.children);
  }
  EXPECT_EQ(seen, std::size_t((n + 1) * (n + 1) * (n + 1) - 8)) << "every vertex but the corners is the centre of exactly one diamond";
}

INSTANTIATE_TEST_SUITE_P(UpTo17, DiamondTable, ::testing::Values(1, 2, 3, 4));

TEST(Diamond, EachClassHasItsNumbers) {
  int types = 0;
  for (unsigned type = 0; type < 64; ++type) {
    const DiamondType& t = diamond_type(type);
    if (t.cls == 3) continue;
    ++types;
    EXPECT_EQ(t.tets, (std::array{6, 4, 8}[t.cls]));
    EXPECT_EQ(t.parents, (std::array{3, 2, 4}[t.cls]));
    EXPECT_EQ(t.children, (std::array{6, 4, 8}[t.cls]));
    EXPECT_EQ(t.vertices, (std::array{8, 6, 10}[t.cls]));
    EXPECT_EQ(t.edges, (std::array{19, 13, 25}[t.cls]));
  }
  EXPECT_EQ(types, 56);
}

TEST(Diamond, ADuetIsTwoTetrahedraOfItsChild) {
  for (unsigned type = 0; type < 64; ++type) {
    const DiamondType& t = diamond_type(type);
    if (t.cls == 3) continue;
    std::set<std::pair<int, int>> halves;
    const std::int32_t h = 8;
    const Diamond parent({64 + h * std::int32_t(type & 3), 64 + h * std::int32_t(type >> 2 & 3), 64 + h * std::int32_t(type >> 4)});
    ASSERT_EQ(parent.type, type);
    for (int k = 0; k < t.children; ++k) {
      const Diamond child(parent.child(k));
      for (const Duet::Half& half : t.child[k].half) {
        EXPECT_TRUE(halves.insert({half.tet, half.end}).second);
        auto local = t.tet(half.tet);
        local[1 - half.end] = kCentre;
        const auto is_vertex = [&](Vertex v) {
          for (int i = 0; i < child.row->vertices; ++i) {
            if (child.vertex(i) == v) return true;
          }
          return false;
        };
        for (int v : local) EXPECT_TRUE(is_vertex(parent.vertex(v)));
      }
    }
    EXPECT_EQ(halves.size(), std::size_t(2 * t.tets)) << "every half goes to one child";
  }
}

TEST(Diamond, TypeAndScaleFollowFromTheBits) {
  const Diamond d({72, 20, 4});  // the paper's example, section 5, with a third coordinate
  EXPECT_EQ(d.scale, 2);
  EXPECT_EQ(d.type & 3, 2u);
  EXPECT_EQ(d.type >> 2 & 3, 1u);
}

TEST(Diamond, EdgesAreNumberedBothWaysAlike) {
  for (int belt : {4, 6, 8}) {
    for (int e = 0; e < 1 + 3 * belt; ++e) {
      const auto [a, b] = edge_ends(e, belt);
      EXPECT_EQ(edge_between(a, b, belt), e);
      EXPECT_EQ(edge_between(b, a, belt), e);
    }
  }
}

}  // namespace
}  // namespace intervale
