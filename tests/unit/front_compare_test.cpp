// Which fronts are parts of others, and how the one becomes the other.
#include <gtest/gtest.h>

#include <random>

#include "common/front/front.h"
#include "common/ivm/extraction.h"
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
    volume_ = GetParam() % 2 == 0 ? testing::digits(dims, GetParam()) : testing::gyroid(dims);
    range_ = GetParam() % 2 == 0 ? Range{3, 5.5} : Range{-0.3, GetParam() % 3 == 0 ? -0.3 : 0.2};
  }
  Volume volume_;
  Range range_;
};

TEST_P(FrontParts, CoarserIsPartOfFiner) {
  const IntervalVolume sigma = testing::build(volume_, {.range = range_});
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
  const IntervalVolume sigma = testing::build(volume_, {.range = range_});
  const Front full = front_of(sigma, {});
  const Grid& grid = volume_.grid;
  std::mt19937 random(GetParam());
  for (int trial = 0; trial < 5; ++trial) {
    Box box;
    for (std::size_t i = 0; i < 3; ++i) {
      box.min[i] = grid.affine.origin()[i] + grid.affine.spacing()[i] * double(random() % std::uint32_t(grid.dims[i]));
      box.max[i] = box.min[i] + grid.affine.spacing()[i] * 2;
    }
    const Front part = front_of(sigma, within(box));
    ASSERT_TRUE(part.is_part_of(full));
    Front coarsened = full;
    ASSERT_TRUE(coarsened.coarsen_to(part));
    EXPECT_EQ(coarsened.validate(), std::nullopt);
    EXPECT_EQ(coarsened.split_count(), part.shown_count());
    EXPECT_TRUE(coarsened.is_part_of(part));  // what was merged counts no more
    EXPECT_EQ(canonical(coarsened.mesh()), canonical(part.mesh()));
  }
}

INSTANTIATE_TEST_SUITE_P(Random, FrontParts, ::testing::Range(1u, 13u));

TEST(FrontCompare, OneOtherValueIsAnotherFront) {
  const IntervalVolume sigma = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  const Front full = front_of(sigma, {});
  for (const UpdateIndex changed : {UpdateIndex(0), UpdateIndex(sigma.size() / 2), UpdateIndex(sigma.size() - 1)}) {
    Front other = root_front(sigma.description());
    sigma.set().for_each_down([&](const Place& p) {
      const auto handle = other.find(SupercubeSet::centre(p));
      ASSERT_TRUE(handle);
      other.split(*handle, p.index == changed ? sigma.key(p.index) ^ 1 : sigma.key(p.index));
    });
    EXPECT_FALSE(other.is_part_of(full));
    EXPECT_FALSE(full.is_part_of(other));
  }
}

TEST(FrontCompare, OtherGridsRangesAndCornersAreOtherFronts) {
  const IntervalVolume sigma = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  const Front front = front_of(sigma, {});
  const Description& same = sigma.description();
  EXPECT_TRUE(root_front(same).is_part_of(front));
  std::vector<Description> others(4, same);
  others[0].grid.affine.rows[3] += 1;
  others[1].range.beta = 0.25;
  others[2].corners[7] ^= 1;
  others[3].format.first += 1;
  for (const Description& other : others) EXPECT_FALSE(root_front(other).is_part_of(front));
}

TEST(FrontCompare, WhatTheCoarserNeedsIsNotMerged) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  Front root = root_front(sigma.description());
  const Front full = front_of(sigma, {});
  EXPECT_TRUE(root.coarsen_to(full));  // nothing to merge
  EXPECT_EQ(root.split_count(), 0u);
}

}  // namespace
}  // namespace intervale
