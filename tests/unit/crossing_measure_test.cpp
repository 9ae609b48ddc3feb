#include "common/ranges/crossing_measure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "common/ranges/surface_deviation.h"
#include "common/util/bits.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/naive_surfaces.h"

namespace intervale {
namespace {

using testing::NaiveCrossing;
using testing::NaivePatch;
using testing::SurfaceCase;

// A point's distance to a flat convex polygon.
double distance_to_patch(const Vec3& p, const PatchPolygon& patch) {
  if (patch.count == 0) return kInf;
  const Vec3 normal = normalized(cross(subtract(patch.corner[1], patch.corner[0]), subtract(patch.corner[2], patch.corner[0])));
  const double height = dot(normal, subtract(p, patch.corner[0]));
  bool is_above = true;
  for (int i = 0; i < patch.count; ++i) {
    const Vec3 &a = patch.corner[i], side = subtract(patch.corner[(i + 1) % patch.count], a);
    is_above = is_above && dot(cross(side, subtract(p, a)), normal) >= 0;
  }
  return is_above ? std::abs(height) : std::sqrt(PatchBorder(patch).squared_distance(p));
}

class CrossingDistances : public ::testing::TestWithParam<unsigned> {};

// By their exact distance to the patches of a diamond that holds them: nearly all are no further away than was measured, and
// none much.
TEST_P(CrossingDistances, NoCrossingIsFartherFromThePatchesThanMeasured) {
  const SurfaceCase c = testing::case_of_seed(GetParam());
  SCOPED_TRACE(c.name);
  const FieldHierarchy delta(c.volume, {.range = c.range});
  const Domain& domain = delta.domain();
  const SurfaceDeviation found = surface_deviation(c.volume, c.range, domain, delta.set(), true);
  ASSERT_EQ(found.farthest.size(), delta.set().size());
  const std::vector<NaiveCrossing> crossings = testing::crossings_of(c.volume, c.range);
  const double rounding = 2 * testing::kLeastMove * diamond_width(c.volume.grid);
  std::size_t all = 0, farther = 0;
  double worst = 0;
  for (int scale = 0; scale <= found.top_scale; ++scale) {
    for (int cls = 0; cls < 3; ++cls) {
      std::vector<double> excess(crossings.size(), kInf);  // of a distance over what was measured; the least of all diamonds
      delta.set().for_each(scale, cls, [&](const Place& p) {
        const Diamond d(SupercubeSet::centre(p));
        const double measured = double(found.farthest[p.index]) + rounding;
        std::vector<NaivePatch> tets;
        std::vector<std::array<PatchPolygon, 2>> patches;  // of alpha and beta
        for (const int t : set_bits(domain.tets(d))) {
          std::array<Vec3, 4> at;
          std::array<double, 4> values;
          for (int i = 0; i < 4; ++i) {
            const Vertex v = domain.clamp(d.vertex(d.row->tet(t)[i]));
            at[i] = c.volume.grid.affine.point({double(v.x), double(v.y), double(v.z)});
            values[i] = testing::value_at(c.volume, domain, v);
          }
          tets.emplace_back(c.volume, domain, d, t);
          patches.push_back({PatchPolygon(at, values, {c.range.alpha, false}), PatchPolygon(at, values, {c.range.beta, true})});
        }
        for (std::size_t i = 0; i < crossings.size(); ++i) {
          const Vec3& at = crossings[i].at;
          if (std::max({std::abs(at[0] - d.centre.x), std::abs(at[1] - d.centre.y), std::abs(at[2] - d.centre.z)}) > d.h + 1e-6) continue;
          if (std::none_of(tets.begin(), tets.end(), [&at](const NaivePatch& tet) { return tet.holds(at); })) continue;
          double nearest = kInf;
          for (const auto& both : patches)
            nearest = std::min(nearest, distance_to_patch(c.volume.grid.affine.point(at), both[crossings[i].is_beta ? 1 : 0]));
          excess[i] = std::min(excess[i], nearest == kInf ? 0 : nearest / measured);
        }
      });
      for (const double e : excess) {
        if (e == kInf) continue;
        ++all;
        farther += e > 1 + 1e-4;
        worst = std::max(worst, e);
      }
    }
  }
  EXPECT_GT(all, 0u);
  EXPECT_LE(farther, all / 100) << "of " << all;
  EXPECT_LE(worst, 1.25);
}

// Where no distance can be computed, the width of the diamond is one.
TEST(CrossingMeasure, DistancesAreNotLostWhereValuesAreFarApart) {
  std::mt19937 random(3);
  std::vector<double> samples(9 * 9 * 9);
  for (double& s : samples) s = (random() % 2 == 0 ? 1 : -1) * std::exp2(900 + double(random() % 100));
  const Volume volume = testing::volume_of_type(SampleType::f64, {9, 9, 9}, samples);
  const FieldHierarchy delta(volume, {.range = {0, kInf}});
  const SurfaceDeviation found = surface_deviation(volume, {0, kInf}, delta.domain(), delta.set(), true);
  delta.set().for_each_down([&](const Place& p) {
    EXPECT_TRUE(std::isfinite(found.farthest[p.index]));
    if (found.largest[p.index] > 0) {
      EXPECT_GT(found.farthest[p.index], 0);
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Fields, CrossingDistances, ::testing::Range(0u, 16u));

}  // namespace
}  // namespace intervale
