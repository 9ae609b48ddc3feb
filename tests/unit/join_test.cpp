#include "common/mesh/join.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace intervale {
namespace {

// So many tetrahedra around a common edge, from `origin` on.
Mesh fan(std::uint32_t tets, double origin) {
  Mesh mesh;
  for (std::uint32_t i = 0; i < tets + 3; ++i) {
    mesh.points.push_back({origin + i, double(i * i), double(i * i * i)});
    mesh.surface.push_back(Surface(i % 3));
    mesh.value.push_back(origin + 10 * i);
  }
  for (std::uint32_t i = 0; i < tets; ++i) mesh.tets.push_back({0, 1, i + 2, i + 3});
  return mesh;
}

TEST(Joined, EveryTetrahedronKeepsItsPointsAndNamesItsPart) {
  const std::vector<Mesh> parts{fan(3, 0), fan(0, 100), {}, fan(5, 200)};
  const Mesh all = joined(parts);
  ASSERT_EQ(all.tets.size(), 8u);
  ASSERT_EQ(all.part.size(), 8u);
  ASSERT_EQ(all.points.size(), 6u + 3 + 8);
  std::size_t at = 0;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (const auto& tet : parts[p].tets) {
      EXPECT_EQ(all.part[at], p);
      for (std::size_t k = 0; k < 4; ++k) {
        const std::uint32_t joined = all.tets[at][k], own = tet[k];
        EXPECT_EQ(all.points[joined], parts[p].points[own]);
        EXPECT_EQ(all.surface[joined], parts[p].surface[own]);
        EXPECT_EQ(all.value[joined], parts[p].value[own]);
      }
      ++at;
    }
  }
}

TEST(Joined, OneMeshStaysAsItIs) {
  const Mesh one = fan(4, 7), joined_one = joined({one});
  EXPECT_EQ(joined_one.tets, one.tets);
  EXPECT_EQ(joined_one.points, one.points);
  EXPECT_TRUE(joined_one.part.empty());
  EXPECT_TRUE(joined({}).tets.empty());
}

}  // namespace
}  // namespace intervale
