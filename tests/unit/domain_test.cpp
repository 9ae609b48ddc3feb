#include "common/diamond/domain.h"

#include <gtest/gtest.h>

namespace intervale {
namespace {

TEST(Domain, TetrahedraAreThoseThatAreNotFlat) {
  const std::vector<std::array<std::int32_t, 3>> boxes{{9, 9, 9}, {8, 9, 7}, {2, 5, 17}, {6, 10, 5}, {3, 3, 3}, {17, 16, 9}};
  for (const auto& dims : boxes) {
    const Domain domain(dims);
    const std::int32_t n = 1 << domain.levels();
    for (std::int32_t z = 0; z <= n; ++z) {
      for (std::int32_t y = 0; y <= n; ++y) {
        for (std::int32_t x = 0; x <= n; ++x) {
          if ((x | y | z) == 0 || scale_of({x, y, z}) >= domain.levels()) continue;
          const Diamond d({x, y, z});
          unsigned tets = 0, vertices = 0, edges = 0;
          bool moved = false;
          for (int i = 0; i < d.row->tets; ++i) {
            const auto local = d.row->tet(i);
            if (!Domain::exists(domain.positions(d, local))) continue;
            tets |= 1u << i;
            for (int a = 0; a < 4; ++a) {
              vertices |= 1u << local[a];
              moved = moved || !domain.contains(d.vertex(local[a]));
              for (int b = a + 1; b < 4; ++b) edges |= 1u << edge_between(local[a], local[b], d.row->belt);
            }
          }
          ASSERT_EQ(domain.tets(d), tets) << x << ' ' << y << ' ' << z << " in " << dims[0] << ' ' << dims[1] << ' ' << dims[2];
          EXPECT_EQ(Domain::vertices(*d.row, tets), vertices);
          EXPECT_EQ(Domain::edges(*d.row, tets), edges);
          if (domain.is_unmoved(d)) {
            EXPECT_FALSE(moved);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace intervale
