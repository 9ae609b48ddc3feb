// Meshes of any range, from a data set of every range.
#include "common/ivm/value_extraction.h"

#include <gtest/gtest.h>

#include "common/mesh/mesh_digest.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "tests/support/coverage.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class ValueExtraction : public ::testing::TestWithParam<unsigned> {
 public:
  static constexpr std::array<std::array<std::int32_t, 3>, 4> kBoxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}}};
  testing::ValueField field = testing::random_value_field(kBoxes[GetParam() % 4], GetParam());
  Volume samples = field.volume;
  ValueVolume volume = build_value_volume(samples, field.format);
  std::mt19937 random{GetParam()};
};

TEST_P(ValueExtraction, EqualsADataSetOfOneRange) {
  for (int i = 0; i < 6; ++i) {
    const Range range = testing::random_range(field, random);
    const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
    SCOPED_TRACE(testing::text_of(range, refine));
    const auto one = FieldHierarchy(field.volume, {range, refine}).compact();
    ASSERT_TRUE(one);
    const auto expected = extract(*one, Lod{});
    const auto extracted = extract(volume, {range, refine, {}});
    ASSERT_TRUE(expected && extracted);
    EXPECT_EQ(extracted->updates, expected->updates);
    EXPECT_EQ(mesh_digest(extracted->front.mesh()), mesh_digest(expected->front.mesh()));
  }
}

TEST_P(ValueExtraction, ADataSetRefinedUniformlyHasEveryRangeWithinItsOwn) {
  for (int i = 0; i < 4; ++i) {
    const Range outer = testing::random_range(field, random);
    const auto uniform = FieldHierarchy(field.volume, {outer, Refine::uniform}).compact();
    ASSERT_TRUE(uniform);
    const auto full = extract(*uniform, Lod{});
    ASSERT_TRUE(full);
    for (int k = 0; k < 4; ++k) {
      const Range other = testing::random_range(field, random);
      const Range inner{std::max(outer.alpha, other.alpha), std::min(outer.beta, other.beta)};
      if (inner.alpha > inner.beta) continue;
      const Refine refine = random() % 2 == 0 ? Refine::boundary : Refine::uniform;
      SCOPED_TRACE(testing::text_of(outer, Refine::uniform) + " " + testing::text_of(inner, refine));
      const auto one = FieldHierarchy(field.volume, {inner, refine}).compact();
      ASSERT_TRUE(one);
      const auto expected = extract(*one, Lod{});
      ASSERT_TRUE(expected);
      Front front = full->front;
      front.set_range(inner, refine);
      EXPECT_EQ(front.shown_count(), expected->updates);
      EXPECT_EQ(mesh_digest(front.mesh()), mesh_digest(expected->front.mesh()));
    }
  }
}

TEST_P(ValueExtraction, KeepsTheGuaranteeOfItsError) {
  for (int i = 0; i < 3; ++i) {
    const Range range = testing::random_range(field, random);
    SCOPED_TRACE(testing::text_of(range, Refine::boundary));
    Lod lod;
    lod.error_percent = 4 + 8 * i;
    const auto extracted = extract(volume, {range, Refine::boundary, lod});
    ASSERT_TRUE(extracted);
    EXPECT_EQ(extracted->front.validate().value_or(""), "");
    const Mesh mesh = extracted->front.mesh();
    EXPECT_EQ(testing::broken_law(mesh, field.volume.grid, range.alpha == range.beta), "");
    if (range.alpha < range.beta) {
      EXPECT_EQ(testing::broken_guarantee(field.volume, mesh, range, error_of(lod, volume.description().max_error)), "");
    }
  }
}

TEST_P(ValueExtraction, KeepsItsBudgets) {
  const Range range = testing::random_range(field, random);
  const auto all = extract(volume, {range, Refine::boundary, {}});
  ASSERT_TRUE(all);
  Lod lod;
  lod.max_tets = all->front.tet_count() / 3;
  const auto tets = extract(volume, {range, Refine::boundary, lod});
  ASSERT_TRUE(tets);
  const Front root(field.volume.grid, field.format, volume.description().corners, range);
  EXPECT_LE(tets->front.tet_count(), std::max(*lod.max_tets, root.tet_count()));
  lod = {};
  lod.max_updates = all->updates / 2;
  const auto updates = extract(volume, {range, Refine::boundary, lod});
  ASSERT_TRUE(updates);
  EXPECT_LE(updates->updates, *lod.max_updates);
  EXPECT_EQ(testing::broken_law(updates->front.mesh(), field.volume.grid, range.alpha == range.beta), "");
}

INSTANTIATE_TEST_SUITE_P(Random, ValueExtraction, ::testing::Range(0u, 30u));

}  // namespace
}  // namespace intervale
