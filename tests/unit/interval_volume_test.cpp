#include "common/interval_volume.h"

#include <gtest/gtest.h>

#include "server/build/field_hierarchy.h"
#include "support/analytic_fields.h"
#include "support/parts.h"

namespace intervale {
namespace {

class IntervalVolumeValidate : public ::testing::Test {
 protected:
  IntervalVolumeValidate() : volume_(testing::gyroid({9, 9, 9})), made_(FieldHierarchy(volume_, {{-0.3, 0.2}}).compact()) {}
  Volume volume_;
  Result<IntervalVolume> made_;
};

TEST_F(IntervalVolumeValidate, PassesWhatWasBuilt) {
  ASSERT_TRUE(made_);
  EXPECT_TRUE(made_->validate());
  const auto again = IntervalVolume::assemble(testing::parts_of(*made_));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->description(), made_->description());
}

TEST_F(IntervalVolumeValidate, FindsALargestErrorThatIsNone) {
  auto parts = testing::parts_of(*made_);
  parts.description.max_error = 1e6;
  EXPECT_FALSE(IntervalVolume::assemble(std::move(parts))->validate());
}

TEST_F(IntervalVolumeValidate, FindsAFullMeshOfAnotherSize) {
  auto parts = testing::parts_of(*made_);
  ++parts.description.full.vertices;
  EXPECT_FALSE(IntervalVolume::assemble(std::move(parts))->validate());
  parts = testing::parts_of(*made_);
  --parts.description.full.tets;
  EXPECT_FALSE(IntervalVolume::assemble(std::move(parts))->validate());
}

TEST_F(IntervalVolumeValidate, FindsAnErrorGreaterThanItsParents) {
  auto parts = testing::parts_of(*made_);
  UpdateCode& last = parts.codes.back();
  last = UpdateCode(std::uint16_t((last.bits() & 127) | (parts.error_levels.size() - 1) << 7));
  UpdateCode& root = parts.codes.front();
  root = UpdateCode(std::uint16_t(root.bits() & 127));
  EXPECT_FALSE(IntervalVolume::assemble(std::move(parts))->validate());
}

TEST_F(IntervalVolumeValidate, FindsASideThatDoesNotFitItsCoefficients) {
  // Most updates change their number of cuts when their side changes: one of the first few does.
  int found = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    auto parts = testing::parts_of(*made_);
    const std::uint16_t bits = parts.codes[i].bits();
    parts.codes[i] = UpdateCode(std::uint16_t((bits & ~3u) | ((bits & 3u) + 1) % 3));
    found += !IntervalVolume::assemble(std::move(parts))->validate();
  }
  EXPECT_GT(found, 15);
}

}  // namespace
}  // namespace intervale
