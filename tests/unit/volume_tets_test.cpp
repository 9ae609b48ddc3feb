#include "client/view/volume_tets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "client/view/point_values.h"
#include "common/ivm/extraction.h"
#include "tests/support/affines.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"

namespace intervale {
namespace {

using Place = std::array<float, 4>;  // a position in samples, and the value
std::multiset<std::multiset<Place>> tets_of(const Mesh& mesh, const Affine& to_samples) {
  std::multiset<std::multiset<Place>> tets;
  for (const auto& tet : mesh.tets) {
    std::multiset<Place> corners;
    for (const auto corner : tet) {
      const Vec3 p = to_samples.point(mesh.points[corner]);
      const auto rounded = [](double x) { return float(std::round(x * 512) / 512); };  // positions are multiples of 1/512
      corners.insert({rounded(p[0]), rounded(p[1]), rounded(p[2]), float(mesh.value[corner])});
    }
    tets.insert(std::move(corners));
  }
  return tets;
}

// Two ranges on a grid of any axes.
class VolumeTetsOf : public ::testing::TestWithParam<unsigned> {
 protected:
  VolumeTetsOf() {
    std::mt19937 random(GetParam());
    auto parts = testing::parts_of(*testing::build_shared(testing::digits({9, 7, 8}, GetParam()), {.range = {0, 9}, .refine = Refine::uniform}));
    parts.description.grid.affine = testing::random_affine(random, GetParam() % 5);
    map_ = parts.description.grid.affine;
    const auto volume = std::move(*IntervalVolume::assemble(std::move(parts)));
    for (const Range& range : {Range{1.5, 4}, Range{3, 6.5}}) {
      Front front = extract(volume, Lod())->front;
      front.set_range(range, Refine::uniform);
      BoundarySurface surface(front);
      (void)surface.update();
      tets_.add(surface, point_values(surface));
      expected_.push_back(tets_of(front.mesh(), map_.inverse()));
    }
    eye_ = map_.point({testing::uniform(random, -30, 30), testing::uniform(random, -30, 30), testing::uniform(random, -30, 30)});
  }
  [[nodiscard]] std::array<VolumePoint, 4> corners(std::size_t tet) const {
    std::array<VolumePoint, 4> corners;
    for (std::size_t k = 0; k < 4; ++k) corners[k] = tets_.points().at(tets_.tets()[tet][k] & 0x3fffffff);
    return corners;
  }

  Affine map_;
  VolumeTets tets_;
  std::vector<std::multiset<std::multiset<Place>>> expected_;  // of each range
  Vec3 eye_;
};

TEST_P(VolumeTetsOf, AreThoseOfTheMeshesAndPositiveInTheWorld) {
  std::vector<std::multiset<std::multiset<Place>>> found(2);
  for (std::size_t tet = 0; tet < tets_.tets().size(); ++tet) {
    std::multiset<Place> places;
    std::array<Vec3, 4> at;
    for (std::size_t k = 0; k < 4; ++k) {
      const VolumePoint p = corners(tet)[k];
      places.insert({p.x, p.y, p.z, p.value});
      at[k] = map_.point({p.x, p.y, p.z});
    }
    EXPECT_GT(triple_product(subtract(at[1], at[0]), subtract(at[2], at[0]), subtract(at[3], at[0])), 0);
    found.at(tets_.tets()[tet][0] >> VolumeTets::kRangeShift).insert(std::move(places));
  }
  EXPECT_GT(found[0].size(), 100u);
  EXPECT_GT(found[1].size(), 100u);
  EXPECT_TRUE(found == expected_);
}

TEST_P(VolumeTetsOf, AreOrderedFromTheFarthestToTheNearest) {
  const std::vector<std::uint32_t> order = tets_.order(eye_);
  ASSERT_EQ(order.size(), tets_.tets().size());
  ASSERT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), order.size());
  std::vector<double> distances;
  distances.reserve(order.size());
  for (const std::uint32_t tet : order) {
    Vec3 centre{};
    for (const VolumePoint& p : corners(tet)) centre = {centre[0] + p.x / 4.0, centre[1] + p.y / 4.0, centre[2] + p.z / 4.0};
    distances.push_back(length(subtract(map_.point(centre), eye_)));
  }
  const double tolerance = (*std::max_element(distances.begin(), distances.end()) - *std::min_element(distances.begin(), distances.end())) / 30000;
  for (std::size_t i = 1; i < distances.size(); ++i) EXPECT_LT(distances[i], distances[i - 1] + tolerance);
}

// The differences of the distances are then those along the line of sight.
TEST_P(VolumeTetsOf, AreOrderedHoweverFarTheEyeIs) {
  const Vec3 centre = map_.point({4, 3, 3.5}), direction = normalized(subtract(eye_, centre));
  for (const double far : {1e12, 1e19, 1e25, 1e30, 1e300}) {
    const auto order = tets_.order({far * direction[0], far * direction[1], far * direction[2]});
    ASSERT_EQ(std::set<std::uint32_t>(order.begin(), order.end()).size(), tets_.tets().size());
    std::vector<double> depths;
    depths.reserve(order.size());
    for (const std::uint32_t tet : order) {
      Vec3 middle{};
      for (const VolumePoint& p : corners(tet)) middle = {middle[0] + p.x / 4.0, middle[1] + p.y / 4.0, middle[2] + p.z / 4.0};
      depths.push_back(-dot(subtract(map_.point(middle), centre), direction));
    }
    const auto [nearest, farthest] = std::minmax_element(depths.begin(), depths.end());
    const double tolerance = (*farthest - *nearest) / 30000;
    for (std::size_t i = 1; i < depths.size(); ++i) ASSERT_LT(depths[i], depths[i - 1] + tolerance) << far;
  }
}

INSTANTIATE_TEST_SUITE_P(Grids, VolumeTetsOf, ::testing::Range(0U, 10U));

TEST(VolumeTets, WithoutAMeshThereIsNothing) {
  EXPECT_TRUE(VolumeTets().tets().empty());
  EXPECT_TRUE(VolumeTets().order({1, 2, 3}).empty());
}

}  // namespace
}  // namespace intervale
