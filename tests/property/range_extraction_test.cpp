// Meshes of any range, from a data set of every range or of one that was refined uniformly.
#include "common/ivm/extraction.h"

#include <gtest/gtest.h>

#include <bit>
#include <memory>

#include "common/ivm/every_range.h"
#include "common/ivm/refinement.h"
#include "common/mesh/mesh_digest.h"
#include "common/ranges/find_relevant_updates.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "tests/support/coverage.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/needs.h"
#include "tests/support/parents.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class RangeExtraction : public ::testing::TestWithParam<unsigned> {
 public:
  static constexpr std::array<std::array<std::int32_t, 3>, 4> kBoxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}}};
  testing::ValueField field = testing::random_value_field(kBoxes[GetParam() % 4], GetParam());
  Volume samples = field.volume;
  std::shared_ptr<const IntervalVolume> volume =
      std::make_shared<const IntervalVolume>(*of_every_range(build_value_volume(samples, field.format).take()));
  std::mt19937 random{GetParam()};

  // A data set of one range of the field.
  [[nodiscard]] std::shared_ptr<const IntervalVolume> one_range(const Range& range, Refine refine) const {
    return std::make_shared<const IntervalVolume>(FieldHierarchy(field.volume, {range, refine}).compact().value());
  }

  [[nodiscard]] static Result<Extraction> mesh_of(const std::shared_ptr<const IntervalVolume>& from, const ShownRange& shown, const Lod& lod = {}) {
    return extract(*from, *find_relevant_updates(from, {shown}, lod.camera ? Distances::measured : Distances::none), lod);
  }
};

TEST_P(RangeExtraction, EqualsADataSetOfOneRange) {
  for (int i = 0; i < 6; ++i) {
    const Range range = testing::random_range(field, random);
    const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
    SCOPED_TRACE(testing::text_of(range, refine));
    const auto one = one_range(range, refine);
    const auto expected = extract(*one, Lod{});
    const auto extracted = mesh_of(volume, {range, refine});
    ASSERT_TRUE(expected && extracted);
    EXPECT_EQ(extracted->updates, expected->updates);
    EXPECT_EQ(mesh_digest(extracted->front.mesh()), mesh_digest(expected->front.mesh()));
  }
}

TEST_P(RangeExtraction, ADataSetRefinedUniformlyHasEveryRangeWithinItsOwn) {
  for (int i = 0; i < 4; ++i) {
    const Range outer = testing::random_range(field, random);
    const auto uniform = one_range(outer, Refine::uniform);
    const auto full = extract(*uniform, Lod{});
    ASSERT_TRUE(full);
    for (int k = 0; k < 4; ++k) {
      const Range other = testing::random_range(field, random);
      const Range inner{std::max(outer.alpha, other.alpha), std::min(outer.beta, other.beta)};
      if (inner.alpha > inner.beta) continue;
      const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
      SCOPED_TRACE(testing::text_of(outer, Refine::uniform) + " " + testing::text_of(inner, refine));
      const auto one = one_range(inner, refine);
      const auto expected = extract(*one, Lod{});
      ASSERT_TRUE(expected);
      Front front = full->front;
      front.set_range(inner, refine);
      EXPECT_EQ(front.shown_count(), expected->updates);
      EXPECT_EQ(mesh_digest(front.mesh()), mesh_digest(expected->front.mesh()));
      const auto extracted = mesh_of(uniform, {inner, refine});
      ASSERT_TRUE(extracted);
      EXPECT_EQ(extracted->updates, expected->updates);
      EXPECT_EQ(mesh_digest(extracted->front.mesh()), mesh_digest(expected->front.mesh()));
    }
  }
}

TEST_P(RangeExtraction, ErrorsAreSaturated) {
  const SupercubeSet& set = volume->set();
  set.for_each_down([&](const Place& p) {
    testing::for_each_parent(set, p, [&](UpdateIndex parent) { ASSERT_GE(volume->error_step(parent), volume->error_step(p.index)); });
  });
  EXPECT_EQ(volume->error_steps().back(), float(volume->description().max_error));
}

// What is relevant, with its ancestors, is what a data set of that range holds; distances are as far as errors are alike.
TEST_P(RangeExtraction, FindsWhatADataSetOfOneRangeHolds) {
  for (int i = 0; i < 4; ++i) {
    const Range range = testing::random_range(field, random);
    const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
    SCOPED_TRACE(testing::text_of(range, refine));
    const auto one = one_range(range, refine);
    const auto relevant = find_relevant_updates(volume, {{range, refine}}, Distances::measured);
    const auto crossed = find_relevant_updates(volume, {{range, Refine::boundary}}, Distances::none);
    const SupercubeSet& all = volume->set();
    const SplitSet closed = select(all, [&](const Place& p) { return testing::is_relevant(*relevant, *volume, p); });
    std::uint64_t updates = 0;
    for (BrickIndex b{0}; b < all.bricks().size(); ++b) {
      all.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        const auto found = one->set().find_supercube(scale_of_key(key), position_of_key(key));
        const std::uint64_t slots = closed.slots(b, key);
        updates += std::uint64_t(std::popcount(slots));
        EXPECT_EQ(slots, found ? one->set().occupancy()[found->supercube] : 0);
        if (!found) return;
        const bool moves = testing::to_distance_of(one->relevant(), *one, found->brick, found->supercube).code() != 0;
        const bool has_error =
            one->error_steps()
                [one->relevant().brick(found->brick).highest(testing::number_in_brick(*one, found->brick, found->supercube)).error_step] > 0;
        // Where a surface only touches the values nothing moves.
        if (moves && has_error && testing::slots_of(*crossed, *volume, b, s) != 0) {
          EXPECT_GT(testing::to_distance_of(*relevant, *volume, b, s).code(), 0);
        }
      });
    }
    EXPECT_EQ(updates, one->size());
  }
}

TEST_P(RangeExtraction, KeepsTheGuaranteeOfItsError) {
  for (int i = 0; i < 3; ++i) {
    const Range range = testing::random_range(field, random);
    SCOPED_TRACE(testing::text_of(range, Refine::boundary));
    Lod lod;
    lod.error_percent = 4 + 8 * i;
    const auto extracted = mesh_of(volume, {range, Refine::boundary}, lod);
    ASSERT_TRUE(extracted);
    EXPECT_EQ(extracted->front.validate().value_or(""), "");
    const Mesh mesh = extracted->front.mesh();
    EXPECT_EQ(testing::broken_law(mesh, field.volume.grid, range.alpha == range.beta), "");
    if (range.alpha < range.beta) {
      EXPECT_EQ(testing::broken_guarantee(field.volume, mesh, range, error_of(lod, volume->description().max_error)), "");
    }
  }
}

TEST_P(RangeExtraction, KeepsItsBudgets) {
  const Range range = testing::random_range(field, random);
  const auto all = mesh_of(volume, {range, Refine::boundary});
  ASSERT_TRUE(all);
  Lod lod;
  lod.max_tets = all->front.tet_count() / 3;
  const auto tets = mesh_of(volume, {range, Refine::boundary}, lod);
  ASSERT_TRUE(tets);
  const Front root(field.volume.grid, field.format, volume->description().corners, range);
  EXPECT_LE(tets->front.tet_count(), std::max(*lod.max_tets, root.tet_count()));
  lod = {};
  lod.max_updates = all->updates / 2;
  const auto updates = mesh_of(volume, {range, Refine::boundary}, lod);
  ASSERT_TRUE(updates);
  EXPECT_LE(updates->updates, *lod.max_updates);
  EXPECT_EQ(testing::broken_law(updates->front.mesh(), field.volume.grid, range.alpha == range.beta), "");
}

INSTANTIATE_TEST_SUITE_P(Random, RangeExtraction, testing::seeds(0, 30));

}  // namespace
}  // namespace intervale
