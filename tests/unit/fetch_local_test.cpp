// Fetching from a data set in memory: as from a server that serves it.
#include "client/local/fetch_local.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "common/ivm/extraction.h"
#include "common/mesh/mesh_digest.h"
#include "tests/support/interval_volumes.h"

namespace intervale::fetch_locals {
namespace {

using ::testing::HasSubstr;
using SharedVolume = std::shared_ptr<const IntervalVolume>;

const SharedVolume& gyroid() {
  static const SharedVolume volume = testing::build_shared(testing::gyroid({33, 30, 25}), {.range = {-0.3, 0.2}, .refine = Refine::uniform});
  return volume;
}

TEST(FetchLocal, EndsWithTheMeshThatExtractMakes) {
  for (const double error : {0.0, 0.05, 0.3}) {
    FetchOptions options;
    options.lod.error = error;
    const auto fetched = fetch_local(gyroid(), options, {});
    ASSERT_TRUE(fetched) << fetched.error().message;
    EXPECT_TRUE(fetched->stats.is_complete);
    EXPECT_EQ(fetched->stats.session.connections, 1u);
    EXPECT_GT(fetched->stats.session.bytes, 0u);
    const auto extracted = extract(*gyroid(), gyroid()->relevant(), options.lod, serial);
    ASSERT_TRUE(extracted);
    EXPECT_EQ(mesh_digest(fetched->client.mesh()), mesh_digest(extracted->front.mesh(serial)));
  }
}

TEST(FetchLocal, KeepsToItsBudgets) {
  FetchOptions few;
  few.lod.max_tets = 2000;
  const auto small = fetch_local(gyroid(), few, {});
  ASSERT_TRUE(small) << small.error().message;
  EXPECT_LE(small->client.tet_count(), 2000u);
  FetchOptions poor;
  poor.max_bytes = 20'000;
  const auto cheap = fetch_local(gyroid(), poor, {});
  ASSERT_TRUE(cheap) << cheap.error().message;
  EXPECT_FALSE(cheap->stats.is_complete);
  EXPECT_LE(cheap->stats.session.bytes, 20'000u);
}

TEST(FetchLocal, ShowsOtherRangesAndSaysWhatIsNotThere) {
  FetchOptions options;
  options.shown.ranges = {{-0.1, 0.1}, {0.15, 0.2}};
  std::size_t batches = 0;
  const auto two = fetch_local(gyroid(), options, {.on_batch = [&batches](const StreamClient&, const FetchStats&) { ++batches; }});
  ASSERT_TRUE(two) << two.error().message;
  EXPECT_EQ(two->client.meshes().size(), 2u);
  EXPECT_GT(batches, 0u);
  options.shown.ranges = {{-5, 5}};
  EXPECT_FALSE(fetch_local(gyroid(), options, {}));
  options.shown.ranges = {};
  options.channels = {"none"};
  EXPECT_THAT(fetch_local(gyroid(), options, {}).error().message, HasSubstr("none"));
  FetchOptions wrong;
  wrong.lod.error = -1;
  EXPECT_FALSE(fetch_local(gyroid(), wrong, {}));
}

}  // namespace
}  // namespace intervale::fetch_locals
