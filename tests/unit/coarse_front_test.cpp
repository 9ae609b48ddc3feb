#include "client/view/coarse_front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "client/view/boundary_surface.h"
#include "client/view/drawn_range.h"
#include "client/view/point_values.h"
#include "client/view/stand_in.h"
#include "common/selection/stream_plan.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"

namespace intervale {
namespace {

using testing::canonical;

// A client that has all of a volume.
StreamClient client_of(const IntervalVolume& volume) {
  const auto shared = std::shared_ptr<const IntervalVolume>(&volume, [](const IntervalVolume*) {});
  StreamPlan plan(shared);
  plan.set_lod({});
  auto client = StreamClient::start(volume.description());
  while (const auto batch = plan.next(4096)) EXPECT_TRUE(client->apply(batch->payload));
  return std::move(*client);
}

class CoarseFrontOf : public ::testing::TestWithParam<unsigned> {
 protected:
  std::shared_ptr<const IntervalVolume> volume_ =
      GetParam() % 2 == 0 ? testing::build_shared(testing::gyroid({17, 12, 33}), {.range = {-0.3, 0.2}, .refine = Refine::uniform})
                          : testing::build_shared(testing::digits({13, 20, 6}, GetParam()), {.range = {3, 5.5}, .refine = Refine::uniform});
  StreamClient client_ = client_of(*volume_);
};

TEST_P(CoarseFrontOf, EachLevelIsPartOfTheNextFinerOne) {
  Front finer = coarse_front(client_, 0);
  EXPECT_EQ(canonical(finer.mesh()), canonical(client_.mesh()));
  const std::vector<std::uint64_t> counts = counts_without_finest(client_);
  EXPECT_EQ(counts.front(), finer.split_count());
  EXPECT_EQ(counts.back(), 0U);
  for (int levels = 1; finer.split_count() > 0; ++levels) {
    Front coarse = coarse_front(client_, levels);
    ASSERT_EQ(coarse.validate(), std::nullopt);
    ASSERT_TRUE(coarse.is_part_of(finer));
    ASSERT_LT(std::size_t(levels), counts.size());
    ASSERT_EQ(coarse.split_count(), counts[std::size_t(levels)]);
    ASSERT_LE(coarse.split_count(), finer.split_count());
    finer = std::move(coarse);
    ASSERT_LE(levels, 24) << "in the end nothing is left";
  }
}

TEST_P(CoarseFrontOf, AnotherRangeShowsWhatTheFineMeshHasOfTheseLevels) {
  const Range range = client_.front().range(), within{range.alpha + 0.1, range.beta - 0.1};
  Front moved = coarse_front(client_, 3);
  moved.set_range(within, Refine::boundary);
  ASSERT_TRUE(client_.show({.ranges = {within}, .refine = Refine::boundary}));
  EXPECT_EQ(canonical(moved.mesh()), canonical(coarse_front(client_, 3).mesh()));
  EXPECT_LE(moved.tet_count(), client_.tet_count());
}

TEST_P(CoarseFrontOf, IsDrawnInPlaceOfTheMeshUntilThatIsAskedFor) {
  DrawnRange drawn(client_.front());
  (void)drawn.update(false, {});
  const std::uint64_t exact = drawn.surface().triangles();
  const ShownRange within{{client_.front().range().alpha + 0.1, client_.front().range().beta}, Refine::boundary};
  for (const int levels : {6, 3}) {
    drawn.use_coarse(client_, levels, within);
    EXPECT_TRUE(drawn.update(false, DrawnRange::WantedValues{}).reset);
    Front coarse = coarse_front(client_, levels);
    coarse.set_range(within.range, within.refine);
    BoundarySurface surface(coarse);
    (void)surface.update();
    EXPECT_EQ(drawn.surface().triangles(), surface.triangles());
    EXPECT_EQ(drawn.values(), point_values(surface));
  }
  drawn.use_exact();
  EXPECT_TRUE(drawn.update(false, {}).reset);
  EXPECT_EQ(drawn.surface().triangles(), exact);
  EXPECT_TRUE(drawn.values().empty());
  const BoundarySurface::Change none = drawn.update(false, {});
  EXPECT_TRUE(!none.reset && none.pieces.empty() && none.removed.empty());
}

TEST_P(CoarseFrontOf, StandsInForWhatIsShownOnly) {
  const Grid& grid = client_.description().grid;
  Box half = box_of(grid);
  half.max[0] = (half.min[0] + half.max[0]) / 2;
  client_.look({.eye = {60, 50, 70}}, half);
  const Front& shown = client_.front();
  ASSERT_GT(shown.withheld_count(), 0u);
  EXPECT_EQ(canonical(coarse_shown_front(client_, shown, 0).mesh()), canonical(client_.mesh()));
  for (const int levels : {1, 3, 5}) {
    const Front coarse = coarse_shown_front(client_, shown, levels);
    EXPECT_EQ(coarse.validate(), std::nullopt);
    EXPECT_LE(coarse.shown_count(), shown.shown_count());
  }
}

TEST_P(CoarseFrontOf, AStandInHasNoMoreTrianglesThanThereIsTimeFor) {
  ASSERT_TRUE(client_.show({.ranges = {client_.front().range(), {client_.front().range().alpha, client_.front().range().alpha + 0.2}}}));
  std::uint64_t full = 0;
  for (const Front& front : client_.fronts()) {
    BoundarySurface surface(front);
    (void)surface.update();
    full += surface.triangles();
  }
  for (const std::uint64_t most : {2 * full, full, full - 1, full / 3, full / 10, std::uint64_t(0)}) {
    StandIn stand_in(client_, full, most);
    ASSERT_EQ(stand_in.ranges().size(), 2u);
    const std::uint64_t coarsest = StandIn(client_, full, 0).triangles();
    EXPECT_LE(stand_in.triangles(), std::max(most, coarsest));
    if (most >= full) {
      EXPECT_EQ(stand_in.triangles(), full);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, CoarseFrontOf, ::testing::Range(0u, 4u));

}  // namespace
}  // namespace intervale
