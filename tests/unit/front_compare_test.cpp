// Which fronts are parts of others, and how the one becomes the other.
#include <gtest/gtest.h>

#include <random>

#include "common/codec/root_patch.h"
#include "common/front/front.h"
#include "common/ivm/extraction.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"

namespace intervale {
namespace {

using testing::canonical;

Front front_of(const IntervalVolume& sigma, const Lod& lod) { return extract(sigma, lod).value().front; }

Lod within(const Box& box) {
  Lod lod;
  lod.roi = box;
  return lod;
}

class FrontParts : public ::testing::TestWithParam<unsigned> {
 protected:
  FrontParts() {
    std::mt19937 random(GetParam());
    const auto side = [&] { return std::int32_t(2 + random() % 12); };
    const std::array<std::int32_t, 3> dims{side(), side(), side()};
    volume = GetParam() % 2 == 0 ? testing::digits(dims, GetParam()) : testing::gyroid(dims);
    range = GetParam() % 2 == 0 ? Range{3, 5.5} : Range{-0.3, GetParam() % 3 == 0 ? -0.3 : 0.2};
  }
  Volume volume;
  Range range;
};

TEST_P(FrontParts, CoarserIsPartOfFiner) {
  const IntervalVolume sigma = testing::build(volume, {.range = range});
  const Front full = front_of(sigma, {});
  EXPECT_TRUE(full.is_part_of(full));
  for (const double percent : {0.0, 10.0, 40.0, 100.0}) {
    Lod lod;
    lod.error_percent = percent;
    const Front coarse = front_of(sigma, lod);
    EXPECT_TRUE(coarse.is_part_of(full));
    EXPECT_EQ(full.is_part_of(coarse), coarse.split_count() == full.split_count());
  }
}

TEST_P(FrontParts, CoarsenedIsTheSameMesh) {
  const IntervalVolume sigma = testing::build(volume, {.range = range});
  const Front full = front_of(sigma, {});
  const Grid& grid = volume.grid;
  std::mt19937 random(GetParam());
  for (int trial = 0; trial < 5; ++trial) {
    Box box;
    for (std::size_t i = 0; i < 3; ++i) {
      box.min[i] = grid.origin[i] + grid.spacing[i] * double(random() % std::uint32_t(grid.dims[i]));
      box.max[i] = box.min[i] + grid.spacing[i] * 2;
    }
    const Front part = front_of(sigma, within(box));
    ASSERT_TRUE(part.is_part_of(full));
    Front coarsened = full;
    ASSERT_TRUE(coarsened.coarsen_to(part));
    EXPECT_EQ(coarsened.validate(), std::nullopt);
    EXPECT_EQ(coarsened.split_count(), part.split_count());
    EXPECT_TRUE(coarsened.is_part_of(part));  // what was merged counts no more
    EXPECT_EQ(canonical(coarsened.mesh()), canonical(part.mesh()));
  }
}

INSTANTIATE_TEST_SUITE_P(Random, FrontParts, ::testing::Range(1u, 13u));

TEST(FrontCompare, OneOtherCutIsAnotherFront) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  const RootPatch root_patch = decode_root_patch(sigma.description().root_patch, sigma.domain()).value();
  Front one(volume.grid, root_patch), other(volume.grid, root_patch);
  ASSERT_TRUE(one.is_part_of(other));
  bool differs = false;
  sigma.set().for_each_down([&](const Place& place) {
    const auto handle = one.find(sigma.set().centre(place));
    if (differs || !handle) return;
    const Side side = Side::inside;
    const auto count = std::size_t(one.context(*handle).count_cuts(side).all);
    std::vector<std::uint8_t> cuts(count, 100);
    one.split(*handle, side, cuts);
    if (count > 0) cuts.back() = 101;
    differs = count > 0;
    other.split(*handle, side, cuts);
    EXPECT_EQ(one.is_part_of(other), !differs);
    EXPECT_EQ(other.is_part_of(one), !differs);
  });
  EXPECT_TRUE(differs);
}

TEST(FrontCompare, OtherGridsAndRootPatchesAreOtherFronts) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  const Front front = front_of(sigma, {});
  Grid moved = volume.grid;
  moved.origin[0] += 1;
  const RootPatch root_patch = decode_root_patch(sigma.description().root_patch, sigma.domain()).value();
  EXPECT_FALSE(Front(moved, root_patch).is_part_of(front));
  const IntervalVolume wider = testing::build(volume, {.range = {-10, 10}});  // all of it is inside
  EXPECT_FALSE(Front(volume.grid, decode_root_patch(wider.description().root_patch, wider.domain()).value()).is_part_of(front));
}

TEST(FrontCompare, WhatTheCoarserNeedsIsNotMerged) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  Front root(volume.grid, decode_root_patch(sigma.description().root_patch, sigma.domain()).value());
  const Front full = front_of(sigma, {});
  EXPECT_TRUE(root.coarsen_to(full));  // nothing to merge
  EXPECT_EQ(root.split_count(), 0u);
}

}  // namespace
}  // namespace intervale
