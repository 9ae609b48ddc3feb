#include "common/ranges/update_slopes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "common/ivm/relevant_updates.h"
#include "common/parallel/all_cores.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/parents.h"

namespace intervale {
namespace {

struct NaiveCluster {
  double removed = 0, updates = 1;
  [[nodiscard]] double slope() const { return removed / updates; }
};

// By update: of its cluster. Unlike update_slopes() it goes by the lists of children.
std::vector<double> naive_slopes(const SupercubeSet& set, const std::vector<double>& removed, int scales) {
  std::vector<std::vector<UpdateIndex>> children(set.size());
  std::vector<int> parents(set.size());
  set.for_each_down([&](const Place& p) {
    testing::for_each_parent(set, p, [&](UpdateIndex parent) {
      children[parent].push_back(p.index);
      ++parents[p.index];
    });
  });
  std::vector<NaiveCluster> cluster(set.size());
  for (int scale = 0; scale < scales; ++scale) {
    for (int cls = 2; cls >= 0; --cls) {
      set.for_each(scale, cls, [&](const Place& p) {
        std::vector<NaiveCluster> below;
        for (const UpdateIndex child : children[p.index])
          below.push_back({cluster[child].removed / parents[child], cluster[child].updates / parents[child]});
        std::sort(below.begin(), below.end(), [](const NaiveCluster& a, const NaiveCluster& b) { return a.slope() > b.slope(); });
        NaiveCluster own{std::max(removed[p.index], 0.0)};
        for (const NaiveCluster& b : below) {
          if (b.slope() <= own.slope()) break;
          own.removed += b.removed;
          own.updates += b.updates;
        }
        cluster[p.index] = own;
      });
    }
  }
  std::vector<double> slopes;
  slopes.reserve(cluster.size());
  for (const NaiveCluster& c : cluster) slopes.push_back(c.slope());
  return slopes;
}

TEST(UpdateSlopes, AreThoseOfClusters) {
  std::mt19937 random(1);
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Volume volume = testing::bump({17, 9, 20}, seed);
    const FieldHierarchy delta(volume, {.range = {40, 90}});
    const int scales = delta.domain().levels();
    std::vector<double> removed(delta.set().size());
    for (double& r : removed) r = random() % 5 == 0 ? 0 : std::exp2(int(random() % 2000) * 0.01 - 12) * (random() % 8 == 0 ? -1 : 1);
    const std::vector<double> naive = naive_slopes(delta.set(), removed, scales);
    const std::vector<std::uint8_t> slopes = update_slopes(delta.set(), removed, scales, 2);
    ASSERT_EQ(slopes.size(), naive.size());
    std::size_t other = 0;
    delta.set().for_each_down([&](const Place& p) {
      const unsigned slope = slopes[p.index];
      if (scale_of_key(p.key) > 2) {
        ASSERT_EQ(slope, kMaxSlope);
        return;
      }
      ASSERT_LE(std::abs(int(slope) - int(slope_of(naive[p.index]))), 1) << "floats round";
      other += slope != slope_of(naive[p.index]);
    });
    EXPECT_LE(other, slopes.size() / 500);
  }
}

TEST(UpdateSlopes, DoNotDependOnTheNumberOfThreads) {
  const Volume volume = testing::gyroid({17, 17, 17});
  const FieldHierarchy delta(volume, {.range = {-0.3, 0.2}});
  std::vector<double> removed(delta.set().size());
  std::mt19937 random(2);
  for (double& r : removed) r = double(random() % 1000) / 100;
  const int scales = delta.domain().levels();
  EXPECT_EQ(update_slopes(delta.set(), removed, scales, 3, on_all_cores), update_slopes(delta.set(), removed, scales, 3));
}

TEST(UpdateSlopes, AreOnAScaleOfLogarithms) {
  EXPECT_EQ(slope_of(0), 0U);
  EXPECT_EQ(slope_of(-1), 0U);
  EXPECT_EQ(removed_of(0), 0.0F);
  EXPECT_EQ(removed_of(7), 1.0F);
  for (unsigned slope = 1; slope < kMaxSlope; ++slope) {
    EXPECT_EQ(slope_of(removed_of(slope)), slope);
    EXPECT_NEAR(removed_of(slope + 1) / removed_of(slope), std::exp2(1.5), 1e-5);
  }
  EXPECT_EQ(slope_of(1e300), kMaxSlope - 1);
  EXPECT_EQ(slope_of(1e-300), 1U);
}

}  // namespace
}  // namespace intervale
