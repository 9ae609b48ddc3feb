// Properties of a front that is split by cuts: the mesh depends only on which diamonds are split, and merging undoes
// splitting. value_front_test.cpp has those of fronts that are split by values.
#include "common/front/front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "common/ivm/extraction.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/fronts_by_cuts.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"

namespace intervale {
namespace {

using testing::all_of;
using testing::broken_law;
using testing::canonical;
using testing::front_by_cuts;
using testing::split_by_cuts;

class FrontLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  FrontLaws() {
    std::mt19937 random(GetParam());
    const auto side = [&] { return std::int32_t(2 + random() % 11); };
    const std::array<std::int32_t, 3> dims{side(), side(), side()};
    const bool equal = GetParam() % 4 == 0;
    if (GetParam() % 2 == 0) {
      volume_ = testing::digits(dims, GetParam());
      range_ = {3, equal ? 3.0 : 5.5};
    } else {
      volume_ = testing::gyroid(GetParam() % 3 == 0 ? std::array<std::int32_t, 3>{9, 9, 9} : dims);
      range_ = {-0.3, equal ? -0.3 : 0.2};
    }
  }
  [[nodiscard]] FieldHierarchy hierarchy() const { return {volume_, {.range = range_}}; }
  Volume volume_;
  Range range_;
};

TEST_P(FrontLaws, AnyOrderThatRespectsParentsGivesTheSameMesh) {
  const FieldHierarchy delta = hierarchy();
  const testing::Canonical expected = canonical(extract(testing::build(volume_, {.range = range_}), {})->front.mesh());
  for (unsigned trial = 0; trial < 3; ++trial) {
    std::mt19937 random(GetParam() * 10 + trial);
    Front front(volume_.grid, delta.root_patch());
    std::vector<Place> waiting;
    delta.set().for_each_down([&](const Place& p) { waiting.push_back(p); });
    std::size_t steps = 0;
    while (!waiting.empty()) {
      std::shuffle(waiting.begin(), waiting.end(), random);
      std::vector<Place> later;
      for (const Place& p : waiting) {
        const Vertex c = SupercubeSet::centre(p);
        const auto handle = front.find(c);
        if (!handle) {
          later.push_back(p);
          continue;
        }
        split_by_cuts(front, *handle, delta, c);
        if (++steps % 97 == 0) {
          ASSERT_EQ(front.validate(), std::nullopt);
          ASSERT_EQ(broken_law(front.mesh(), volume_.grid, range_.alpha == range_.beta), "");
        }
      }
      ASSERT_LT(later.size(), waiting.size()) << "nothing can be split";
      waiting = later;
    }
    EXPECT_EQ(canonical(front.mesh()), expected);
  }
}

TEST_P(FrontLaws, MergingIsTheInverseOfSplitting) {
  const FieldHierarchy delta = hierarchy();
  std::mt19937 random(GetParam());
  Front front(volume_.grid, delta.root_patch());
  const testing::Canonical coarse = canonical(front.mesh());
  std::set<UpdateIndex> split;
  std::vector<Place> places;
  delta.set().for_each_down([&](const Place& p) { places.push_back(p); });
  if (places.empty()) return;
  const auto afresh = [&] {  // the mesh of this split set, made afresh
    SplitSet set(delta.set().size());
    for (UpdateIndex i : split) set.insert(i);
    return canonical(front_by_cuts(delta, volume_.grid, set).mesh());
  };
  for (int round = 0; round < 12; ++round) {
    // Some splits, then some merges, of whatever can be.
    for (int i = 0; i < 400; ++i) {
      const Place p = places[random() % places.size()];
      const Vertex c = SupercubeSet::centre(p);
      const bool split_now = round % 3 == 2 ? random() % 3 == 0 : random() % 3 != 0;
      if (split_now) {
        const auto handle = front.find(c);
        EXPECT_FALSE(handle && split.contains(p.index));
        if (!handle) continue;
        split_by_cuts(front, *handle, delta, c);
        split.insert(p.index);
      } else {
        if (front.merge(c)) {
          EXPECT_EQ(split.erase(p.index), 1u) << "merged what was not split";
        }
      }
    }
    ASSERT_EQ(front.validate(), std::nullopt);
    ASSERT_EQ(broken_law(front.mesh(), volume_.grid, range_.alpha == range_.beta), "");
    ASSERT_EQ(canonical(front.mesh()), afresh());
  }
  // All the way back.
  for (bool any = true; any;) {
    any = false;
    for (const Place& p : places) {
      if (split.contains(p.index) && front.merge(SupercubeSet::centre(p))) split.erase(p.index), any = true;
    }
  }
  EXPECT_TRUE(split.empty());
  EXPECT_EQ(front.split_count(), 0u);
  EXPECT_EQ(canonical(front.mesh()), coarse);
}

// What is hidden is no part of the mesh; what comes back is as it was.
TEST_P(FrontLaws, HidingIsLeavingOut) {
  const FieldHierarchy delta = hierarchy();
  Front front = front_by_cuts(delta, volume_.grid, all_of(delta.set()));
  const testing::Canonical full = canonical(front.mesh());
  std::vector<Place> all;
  delta.set().for_each_down([&](const Place& p) { all.push_back(p); });
  SplitSet shown = all_of(delta.set());
  const auto afresh = [&] { return canonical(front_by_cuts(delta, volume_.grid, shown).mesh()); };
  const auto may_hide = [&](const Place& p) {
    if (!shown.contains(p.index)) return false;
    return std::none_of(all.begin(), all.end(), [&](const Place& child) {
      bool is_child = false;
      if (!shown.contains(child.index)) return false;
      for_each_parent(delta.set(), child, [&](UpdateIndex parent) { is_child = is_child || parent == p.index; });
      return is_child;
    });
  };
  std::mt19937 random(GetParam());
  for (int step = 0; step < 400 && !all.empty(); ++step) {
    const Place& p = all[random() % all.size()];
    const Front::Handle handle{p.key, p.slot};
    ASSERT_NE(front.is_hidden(handle), shown.contains(p.index));
    const std::uint64_t before = front.tet_count();
    if (random() % 3 != 0) {
      const bool may = may_hide(p);
      ASSERT_EQ(front.hide(handle), may);
      if (may) shown.erase(p.index);
    } else {
      bool may = !shown.contains(p.index);
      for_each_parent(delta.set(), p, [&](UpdateIndex parent) { may = may && shown.contains(parent); });
      if (may && random() % 4 == 0) {
        const bool fits = front.show(handle, before);  // no more than it had
        ASSERT_EQ(fits, !front.is_hidden(handle));
        ASSERT_LE(front.tet_count(), before);
      } else {
        ASSERT_EQ(front.show(handle, ~std::uint64_t(0)), may);
      }
      if (!front.is_hidden(handle)) shown.insert(p.index);
    }
    ASSERT_EQ(front.split_count(), all.size());
    ASSERT_EQ(front.shown_count(), shown.count());
    if (step % 40 != 0) continue;
    ASSERT_EQ(front.validate(), std::nullopt);
    ASSERT_EQ(broken_law(front.mesh(), volume_.grid, range_.alpha == range_.beta), "");
    ASSERT_EQ(front.mesh().tets.size(), front.tet_count());
    ASSERT_EQ(canonical(front.mesh()), afresh());
  }
  for (const Place& p : all) {
    if (!shown.contains(p.index)) {
      ASSERT_TRUE(front.show({p.key, p.slot}, ~std::uint64_t(0)));
    }
  }
  EXPECT_EQ(canonical(front.mesh()), full);
}

INSTANTIATE_TEST_SUITE_P(Random, FrontLaws, ::testing::Range(1u, 25u));

TEST(Front, RefusesWhatCannotBeSplit) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const Front front(volume.grid, FieldHierarchy(volume, {.range = {-0.3, 0.2}}).root_patch());
  EXPECT_TRUE(front.find({4, 4, 4}));
  for (const Vertex v : {Vertex{0, 0, 0}, Vertex{8, 8, 8}, Vertex{2, 2, 2}, Vertex{-4, 4, 4}, Vertex{4, 4, 1 << 30}}) EXPECT_FALSE(front.find(v));
}

TEST(Front, TheBudgetIsNeverPassed) {
  const Volume volume = testing::gyroid({17, 17, 17});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  for (std::uint64_t most : {0u, 100u, 1000u, 5000u}) {
    Lod lod;
    lod.max_tets = most;
    const auto extracted = extract(sigma, lod);
    ASSERT_TRUE(extracted);
    EXPECT_LE(extracted->front.tet_count(), std::max<std::uint64_t>(most, root_front(sigma.description()).tet_count()));
    EXPECT_EQ(broken_law(extracted->front.mesh(), volume.grid), "");
    Lod updates;
    updates.max_updates = most;
    EXPECT_LE(extract(sigma, updates)->updates, most);
  }
}

}  // namespace
}  // namespace intervale
