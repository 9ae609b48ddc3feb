#include "common/diamond/supercube_neighbours.h"

#include <gtest/gtest.h>

#include "common/diamond/supercube.h"

namespace intervale {
namespace {

// Links name the same diamonds as arithmetic on centres, for supercubes of all parities in the middle of a domain.
TEST(SupercubeNeighbours, LeadToVerticesChildrenAndEdges) {
  const int scale = 2;
  for (unsigned parity = 0; parity < 8; ++parity) {
    const Vertex position{4 + std::int32_t(parity & 1), 6 + std::int32_t(parity >> 1 & 1), 2 + std::int32_t(parity >> 2)};
    const auto target = [&](Link link) {
      const SupercubePlace there = neighbour_at(link.where, scale, position);
      return centre_of(there.scale, there.position, Slot(link.slot | there.slot));
    };
    for (Slot slot{0}; slot < kSlots; ++slot) {
      const Diamond d(centre_of(scale, position, slot));
      const Links& links = link_table()[parity][slot];
      for (int v = 0; v < d.row->vertices; ++v) EXPECT_EQ(target(links.vertex[v]), d.vertex(v));
      for (int k = 0; k < d.row->parents; ++k) EXPECT_EQ(d.vertex(links.parent[k]), d.parent(k));
      for (int k = 0; k < d.row->children; ++k) EXPECT_EQ(target(links.child[k]), d.child(k));
      for (int e = 0; e < d.row->edges; ++e) {
        const auto [a, b] = edge_ends(e, d.row->belt);
        const Links::Edge edge = links.edge[e];
        ASSERT_TRUE(edge.owner == a || edge.owner == b);
        const Diamond owner(d.vertex(edge.owner));
        EXPECT_EQ(owner.vertex(edge.other), d.vertex(edge.owner == a ? b : a)) << "a subdivision edge of its younger end";
      }
    }
  }
}

TEST(SupercubeNeighbours, OnlyASupercubeAllOfWhoseDiamondsAreInsideIsInterior) {
  const Domain domain({40, 33, 70});
  for (int scale = 0; scale < domain.levels(); ++scale) {
    for (std::int32_t x = 0; x < 18; ++x) {
      const Vertex position{x, x / 2, x % 3};
      bool all = true;
      for (Slot slot{0}; slot < kSlots; ++slot) all = all && domain.is_interior(Diamond(centre_of(scale, position, slot)));
      EXPECT_EQ(is_interior(domain, scale, position), all);
    }
  }
}

}  // namespace
}  // namespace intervale
