#include "common/ivm/refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/needs.h"

namespace intervale {
namespace {

const Box kEverywhere{{-1e9, -1e9, -1e9}, {1e9, 1e9, 1e9}};

constexpr std::array<testing::Dims, 5> kRefinementBoxes{{{9, 9, 9}, {17, 17, 17}, {12, 5, 7}, {2, 9, 20}, {10, 16, 3}}};

// Boxes of several shapes, in world coordinates that are not the samples'.
IntervalVolume refinement_volume(unsigned seed) {
  const auto trial = testing::trial_of_seed(seed, kRefinementBoxes);
  return testing::build(testing::stretched(trial.volume), trial.options);
}

// The updates' numbers of a diamond's parents.
std::vector<UpdateIndex> parents_of(const IntervalVolume& v, const Diamond& d) {
  std::vector<UpdateIndex> parents;
  for (int k = 0; k < d.row->parents; ++k) {
    const Vertex c = d.parent(k);
    if (c.x < 0 || c.y < 0 || c.z < 0) continue;
    if (const auto p = v.set().find(c)) parents.push_back(p->index);
  }
  return parents;
}

void expect_closed(const IntervalVolume& v, const SplitSet& chosen) {
  v.set().for_each_down([&](const Place& p) {
    if (!chosen.contains(p)) return;
    for (UpdateIndex parent : parents_of(v, Diamond(v.set().centre(p)))) EXPECT_TRUE(chosen.contains(v.set().place(parent)));
  });
}

// A random box; one in three is a point, or reaches beyond the volume.
Box random_box(const Grid& g, std::mt19937& random) {
  Box box;
  const double share = random() % 3 == 0 ? 0 : 0.3;
  for (int i = 0; i < 3; ++i) {
    const double length = g.affine.spacing()[i] * (g.dims[i] - 1);
    box.min[i] = g.affine.origin()[i] + length * (double(random() % 1300) / 1000 - 0.2);
    box.max[i] = box.min[i] + length * share;
  }
  return box;
}

class Select : public ::testing::TestWithParam<unsigned> {};

TEST_P(Select, IsClosedUnderParentsAndWantsNothingElse) {
  const IntervalVolume v = refinement_volume(GetParam());
  const Grid& g = v.description().grid;
  std::mt19937 random(GetParam());
  for (int trial = 0; trial < 20; ++trial) {
    Lod lod;
    if (trial % 2 == 0) lod.error_percent = double(random() % 50);
    if (trial % 4 != 0) lod.roi = random_box(g, random);
    const SplitSet chosen = select(v, lod);
    expect_closed(v, chosen);
    // The naive set: all that counts, is coarser than the error and whose cube of side 2h meets the box; then ancestors.
    const double threshold = error_of(lod, v.description().max_error);
    SplitSet expected(v.set());
    v.set().for_each_up([&](const Place& p) {
      const Diamond d(v.set().centre(p));
      bool wanted = testing::counts_naively(v, p) && (threshold == 0 || v.error(p.index) > threshold);
      const double c[3] = {double(d.centre.x), double(d.centre.y), double(d.centre.z)};
      for (int i = 0; i < 3 && lod.roi; ++i) {
        // Of the box, what lies in the volume, in samples.
        const double lo = std::max(0.0, (lod.roi->min[i] - g.affine.origin()[i]) / g.affine.spacing()[i]),
                     hi = std::min(g.dims[i] - 1.0, (lod.roi->max[i] - g.affine.origin()[i]) / g.affine.spacing()[i]);
        wanted = wanted && lo <= hi && c[i] - d.h <= hi && c[i] + d.h >= lo;
      }
      if (!wanted && !expected.contains(p)) return;
      expected.insert(p);
      for (UpdateIndex parent : parents_of(v, d)) expected.insert(v.set().place(parent));
    });
    EXPECT_TRUE(chosen == expected) << "trial " << trial << ": " << chosen.count() << " chosen, " << expected.count() << " expected";
  }
}

TEST_P(Select, ErrorZeroMeansAllAndTheLargestErrorNone) {
  const IntervalVolume v = refinement_volume(GetParam());
  EXPECT_EQ(select(v, Lod{}).count(), v.size());
  EXPECT_EQ(select(v, Lod{.error_percent = 0}).count(), v.size());
  EXPECT_EQ(select(v, Lod{.error_percent = 100}).count(), 0u);
  EXPECT_EQ(select(v, Lod{.error = v.description().max_error}).count(), 0u);
  EXPECT_EQ(select(v, Lod{.roi = kEverywhere}).count(), v.size());
}

TEST_P(Select, AFinerErrorChoosesNoLess) {
  const IntervalVolume v = refinement_volume(GetParam());
  SplitSet coarser(v.set());
  for (double percent : {90.0, 60.0, 30.0, 10.0, 3.0, 0.3, 0.0}) {
    const SplitSet chosen = select(v, Lod{.error_percent = percent});
    expect_closed(v, chosen);
    v.set().for_each_down([&](const Place& p) {
      EXPECT_TRUE(!coarser.contains(p) || chosen.contains(p));
      const bool is_coarse = percent == 0 || v.error(p.index) > percent / 100 * v.description().max_error;
      if (testing::counts_naively(v, p)) {
        EXPECT_EQ(chosen.contains(p), is_coarse);
      } else {
        EXPECT_TRUE(!chosen.contains(p) || is_coarse) << "an ancestor's error is no smaller";
      }
    });
    coarser = chosen;
  }
}

TEST_P(Select, ARegionOutsideTheBoxChoosesNothing) {
  const IntervalVolume v = refinement_volume(GetParam());
  const Grid& g = v.description().grid;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double steps : {0.01, 0.5, 1.0, 3.0, 1e6}) {
      for (const bool before : {false, true}) {
        Lod lod{.roi = kEverywhere};
        if (before)
          lod.roi->max[axis] = g.affine.origin()[axis] - steps * g.affine.spacing()[axis];
        else
          lod.roi->min[axis] = g.affine.origin()[axis] + (g.dims[axis] - 1 + steps) * g.affine.spacing()[axis];
        if (lod.roi->min[axis] > lod.roi->max[axis]) lod.roi->min[axis] = lod.roi->max[axis];
        EXPECT_EQ(select(v, lod).count(), 0u) << steps << (before ? " steps before axis " : " steps behind axis ") << axis;
      }
    }
  }
}

TEST_P(Select, InOrderParentsComeFirstAndErrorsDoNotAscend) {
  const IntervalVolume v = refinement_volume(GetParam());
  std::mt19937 random(GetParam());
  for (int trial = 0; trial < 4; ++trial) {
    Lod lod;
    if (trial > 0) lod.roi = random_box(v.description().grid, random);
    const SplitSet chosen = select(v, lod);
    const auto order = in_order(v, chosen, lod);
    EXPECT_EQ(order.size(), chosen.count());
    SplitSet seen(v.set());
    float error = std::numeric_limits<float>::max();
    for (UpdateIndex i : order) {
      const Place place = v.set().place(i);
      EXPECT_TRUE(chosen.contains(place) && !seen.contains(place));
      if (!lod.roi && testing::counts_naively(v, place)) {
        EXPECT_LE(v.error(i), error);
        error = v.error(i);
      }
      for (UpdateIndex parent : parents_of(v, Diamond(v.set().centre(place)))) EXPECT_TRUE(seen.contains(v.set().place(parent)));
      seen.insert(place);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, Select, ::testing::Range(0u, 10u));

}  // namespace
}  // namespace intervale
