#include "common/ranges/surface_deviation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/patch/range.h"
#include "common/patch/visit_samples.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/naive_surfaces.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using testing::kLeastMove;
using testing::NaiveCrossing;
using testing::NaivePatch;
using testing::SurfaceCase;

constexpr int kTopScale = 4;     // coarser diamonds have their width
constexpr double kFloat = 1e-5;  // of the field's span: what rounding does to an interpolant

class Moves : public ::testing::TestWithParam<unsigned> {};

TEST_P(Moves, AreThoseOfTheFurthestCrossing) {
  const SurfaceCase c = testing::case_of_seed(GetParam());
  SCOPED_TRACE(c.name);
  const FieldHierarchy delta(c.volume, {.range = c.range});
  const SupercubeSet& set = delta.set();
  const Domain& domain = delta.domain();
  const std::vector<float> moves = surface_deviation(c.volume, c.range, domain, set).largest;
  ASSERT_EQ(moves.size(), set.size());
  const std::vector<NaiveCrossing> crossings = testing::crossings_of(c.volume, c.range);
  ASSERT_FALSE(crossings.empty());
  const double width = diamond_width(c.volume.grid), rounding = kFloat * testing::field_span(c.volume);
  const double furthest = 4 * width * (1 << std::min(kTopScale, domain.levels() - 1));
  std::size_t told = 0;
  for (int scale = 0; scale < domain.levels(); ++scale) {
    for (int cls = 0; cls < 3; ++cls) {
      // Faces between tetrahedra belong to any of those that share them: a crossing is told of if one of them is.
      std::vector<bool> is_there(crossings.size()), is_told(crossings.size());
      set.for_each(scale, cls, [&](const Place& p) {
        const Diamond d(SupercubeSet::centre(p));
        const double move = moves[p.index];
        if (scale > kTopScale) {
          EXPECT_NEAR(move, width * d.h, 1e-6 * width * d.h);
          return;
        }
        const double tip = testing::tip_of(c, domain, d);
        EXPECT_GE(move, tip * (1 - 1e-5) - kLeastMove * width * 1.001);
        double most = tip;
        bool is_lost = false;  // some crossing has no patch to be near to
        std::vector<double> values;
        values.reserve(std::size_t(d.row->vertices));
        for (int i = 0; i < d.row->vertices; ++i) values.push_back(testing::value_at(c.volume, domain, d.vertex(i)));
        const std::array<bool, 2> has_patch{testing::lies_between(values, c.range, false), testing::lies_between(values, c.range, true)};
        for (int t = 0; t < d.row->tets; ++t) {
          if ((domain.tets(d) >> t & 1) == 0) continue;
          const NaivePatch tet(c.volume, domain, d, t);
          for (std::size_t i = 0; i < crossings.size(); ++i) {
            const Vec3& at = crossings[i].at;
            if (std::abs(at[0] - d.centre.x) > d.h + 1e-6 || std::abs(at[1] - d.centre.y) > d.h + 1e-6 || std::abs(at[2] - d.centre.z) > d.h + 1e-6)
              continue;
            if (!tet.holds(at)) continue;
            is_there[i] = true;
            const bool patch = has_patch[crossings[i].is_beta];
            is_lost = is_lost || !patch;
            most = std::max(most, tet.distance(crossings[i], rounding, patch));
            if (move >= tet.distance(crossings[i], -rounding, patch) * (1 - 1e-5) - kLeastMove * width * 1.001) is_told[i] = true;
          }
        }
        if (is_lost && move > width * d.h) most = std::max(most, furthest);
        EXPECT_LE(move, most * (1 + 1e-5) + 1e-5 * width) << "scale " << scale << ", class " << cls << ": further than any crossing";
        told += move > 0;
      });
      for (std::size_t i = 0; i < crossings.size(); ++i) {
        const Vec3& at = crossings[i].at;
        EXPECT_TRUE(is_told[i] || !is_there[i]) << "scale " << scale << ", class " << cls << ": the crossing at " << at[0] << ", " << at[1] << ", "
                                                << at[2] << " moves further";
      }
    }
  }
  EXPECT_GT(told, 0u);
}

// The points of all halves are those of the whole: what all diamonds remove together is the squared deviation of the
// coarsest tetrahedra that are measured. A point in a face belongs to any of those that share it, and one in a face of these
// diamonds may count for each.
TEST_P(Moves, RemoveTogetherTheSquaredDeviationOfTheCoarsestTetrahedra) {
  const SurfaceCase c = testing::case_of_seed(GetParam());
  SCOPED_TRACE(c.name);
  const FieldHierarchy delta(c.volume, {.range = c.range});
  const Domain& domain = delta.domain();
  const SurfaceDeviation found = surface_deviation(c.volume, c.range, domain, delta.set());
  EXPECT_EQ(found.top_scale, std::min(kTopScale, domain.levels() - 1));
  const double width = diamond_width(c.volume.grid) * double(1 << found.top_scale);
  const double rounding = kFloat * testing::field_span(c.volume);
  double least = 0, most = 0;
  for (const NaiveCrossing& crossing : testing::crossings_of(c.volume, c.range)) {
    double nearest = kInf;
    delta.set().for_each(found.top_scale, 0, [&](const Place& p) {
      const Diamond d(SupercubeSet::centre(p));
      std::vector<double> values;
      values.reserve(std::size_t(d.row->vertices));
      for (int i = 0; i < d.row->vertices; ++i) values.push_back(testing::value_at(c.volume, domain, d.vertex(i)));
      const bool has_patch = testing::lies_between(values, c.range, crossing.is_beta);
      double furthest = 0;
      for (int t = 0; t < d.row->tets; ++t) {
        if ((domain.tets(d) >> t & 1) == 0) continue;
        const NaivePatch tet(c.volume, domain, d, t);
        if (!tet.holds(crossing.at)) continue;
        nearest = std::min(nearest, tet.distance(crossing, -rounding, has_patch));
        furthest = std::max(furthest, has_patch ? tet.uncapped_distance(crossing, rounding) : 4 * width);
      }
      most += furthest * furthest;
    });
    if (nearest < kInf) least += nearest * nearest;
  }
  const Vec3 spacing = c.volume.grid.affine.spacing();
  const double shortest = std::min({spacing[0], spacing[1], spacing[2]});
  double sum = 0;
  delta.set().for_each_down([&](const Place& p) {
    sum += found.removed[p.index];
    if (scale_of_key(p.key) > found.top_scale) {
      EXPECT_EQ(found.removed[p.index], 0);
    }
  });
  EXPECT_GT(sum, 0);
  EXPECT_GE(sum * shortest * shortest, least * (1 - 1e-4));
  EXPECT_LE(sum * shortest * shortest, most * (1 + 1e-4));
}

INSTANTIATE_TEST_SUITE_P(Fields, Moves, ::testing::Range(0u, 16u));

// What lies between the same two values of samples deviates most near one of them: points move straight along their
// edges. But a tip may have a crossing near it at either value, and none in between; and rounding decides which of the
// tetrahedra on both sides of a face has a point in it, as most are in the finest ones.
TEST(SurfaceDeviation, IsMostlyLargestNearOneOfTheTwoValuesBetweenWhichASurfaceLies) {
  constexpr double kNearly = 1.0 / 64;
  std::mt19937 random(7);
  std::size_t all = 0, more = 0;
  for (unsigned seed = 0; seed < 32; ++seed) {
    SurfaceCase c{"", testing::digits({9, 8, 9}, seed), {}};
    const double key = 1 + double(random() % 9), within = key - 0.02 - 0.001 * double(random() % 960);
    c.range = {within, kInf};
    const FieldHierarchy delta(c.volume, {.range = c.range});
    const std::vector<float> both = surface_deviation(c.volume, {key - kNearly, key - 1 + kNearly}, delta.domain(), delta.set()).largest;
    const std::vector<float> one = surface_deviation(c.volume, c.range, delta.domain(), delta.set()).largest;
    const double least = 2 * kLeastMove * diamond_width(c.volume.grid);
    delta.set().for_each_down([&](const Place& p) {
      const double tip = testing::tip_of(c, delta.domain(), Diamond(SupercubeSet::centre(p)));
      ++all;
      more += one[p.index] > std::max(double(both[p.index]), tip) * (1 + 1e-4) + least;
    });
  }
  EXPECT_LE(more, all / 20) << "of " << all;
}

// Some samples stand out alone, away from a wall.
TEST(SurfaceDeviation, SpecksThatLieApartMoveAsFarAsToTheNextSurface) {
  const Volume volume = testing::specks({33, 33, 33}, 1);
  const FieldHierarchy delta(volume, {.range = {5, kInf}});
  const std::vector<float> moves = surface_deviation(volume, {5, kInf}, delta.domain(), delta.set()).largest;
  std::size_t far = 0;
  delta.set().for_each_down([&](const Place& p) {
    const Diamond d(SupercubeSet::centre(p));
    if (d.scale >= 3 || d.centre.z - d.h <= 16) return;  // the wall is further than these are wide
    std::array<double, kMaxVertices + 1> values{};
    for (int i = 0; i <= d.row->vertices; ++i) {
      const Vertex v = i < d.row->vertices ? d.vertex(i) : d.centre;
      values[i] = delta.domain().contains(v) ? testing::sample(volume, v.x, v.y, v.z) : 0;
    }
    const bool has_patch = std::any_of(values.begin(), values.begin() + d.row->vertices, [](double v) { return v >= 5; });
    if (has_patch || moves[p.index] == 0) return;
    EXPECT_GE(moves[p.index], 16);
    ++far;
  });
  EXPECT_GT(far, 10u);
}

// Labels: a surface that passes exactly at samples, with nothing on its other side.
TEST(SurfaceDeviation, ASurfaceAtTheLeastOrTheLargestSamplesMoves) {
  std::vector<std::uint8_t> labels(9 * 9 * 9);
  for (int i = 0; i < 9 * 9 * 9; ++i)
    labels[std::size_t(i)] = (i % 9 - 4) * (i % 9 - 4) + (i / 9 % 9 - 3) * (i / 9 % 9 - 3) + (i / 81 - 4) * (i / 81 - 4) < 9;
  const Volume volume = testing::volume_of_type(SampleType::u8, {9, 9, 9}, labels);
  for (const Range range : {Range{1, kInf}, Range{1, 1}, Range{-kInf, 0}, Range{0, 0}}) {
    const FieldHierarchy delta(volume, {.range = range});
    const std::vector<float> moves = surface_deviation(volume, range, delta.domain(), delta.set()).largest;
    ASSERT_GT(moves.size(), 0u);
    EXPECT_GT(std::count_if(moves.begin(), moves.end(), [](float m) { return m > 0; }), 100) << "[" << range.alpha << ", " << range.beta << "]";
  }
}

// What is far from 0 is as good as what is not.
TEST(SurfaceDeviation, DoNotDependOnTheFieldsZero) {
  const Volume volume = testing::gyroid({17, 17, 17});
  std::vector<double> near, far;
  for (std::uint64_t i = 0; i < volume.grid.sample_count(); ++i) {
    const double f = std::round(visit_samples(volume, [i](auto samples) { return double(samples[i]); }) * 1024) / 1024;
    near.push_back(f);
    far.push_back(f + 1e9);
  }
  const auto moves_of = [&](const std::vector<double>& samples, const Range& range) {
    const Volume v = testing::volume_of_type(SampleType::f64, volume.grid.dims, samples);
    const FieldHierarchy delta(v, {.range = range});
    return surface_deviation(v, range, delta.domain(), delta.set()).largest;
  };
  const auto expected = moves_of(near, {-0.25, 0.25}), got = moves_of(far, {1e9 - 0.25, 1e9 + 0.25});
  ASSERT_EQ(got.size(), expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < got.size(); ++i) worst = std::max(worst, double(std::abs(got[i] - expected[i])));
  EXPECT_LT(worst, 1e-2);
}

}  // namespace
}  // namespace intervale
