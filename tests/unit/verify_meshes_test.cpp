#include "client/load/verify_meshes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include "common/ranges/find_relevant_updates.h"
#include "common/selection/stream_plan.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

std::shared_ptr<const IntervalVolume> volume_of_range(const Range& range) {
  return testing::build_shared(testing::gyroid({13, 9, 11}), {.range = range});
}

// A client that has so many batches of the stream.
StreamClient streamed(const std::shared_ptr<const IntervalVolume>& volume, int batches) {
  StreamPlan plan(volume);
  plan.set_lod({});
  auto client = StreamClient::start(volume->description());
  EXPECT_TRUE(client);
  for (; batches > 0; --batches) {
    const auto batch = plan.next(1024);
    if (!batch) break;
    EXPECT_TRUE(client->apply(batch->payload));
  }
  return std::move(*client);
}

TEST(VerifyMeshes, PartsOfTheStreamPass) {
  const auto volume = volume_of_range({-0.3, 0.2});
  std::vector<std::optional<LoadedMesh>> clients;
  for (int batches : {0, 1, 2, 3, 5, 1000}) {
    clients.emplace_back(LoadedMesh{streamed(volume, batches)});
    clients.emplace_back();  // one that failed
  }
  for (unsigned seed = 0; seed < 5; ++seed) {
    const auto verified = verify_meshes(streamed(volume, 1000).fronts(), clients, seed);
    EXPECT_EQ(verified.compared, 6u);
    EXPECT_EQ(verified.differing, 0u);
  }
}

TEST(VerifyMeshes, AnotherMeshIsFound) {
  const auto volume = volume_of_range({-0.3, 0.2});
  std::vector<std::optional<LoadedMesh>> clients;
  clients.reserve(7);
  for (int i = 0; i < 6; ++i) clients.emplace_back(LoadedMesh{streamed(volume, i)});
  clients.emplace_back(LoadedMesh{streamed(volume_of_range({-0.3, 0.21}), 1000)});
  const auto verified = verify_meshes(streamed(volume, 1000).fronts(), clients, 1);
  EXPECT_EQ(verified.compared, 7u);
  EXPECT_EQ(verified.differing, 1u);
}

struct Seen {
  Range range;
  Lod view;
  int batches = 1000;
};

// A client of a data set of several ranges that has seen some of them, one after the other.
StreamClient streamed(const std::shared_ptr<const IntervalVolume>& volume, const std::vector<Seen>& seen) {
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description(), {}, {{seen.front().range}, {}});
  EXPECT_TRUE(client);
  for (const Seen& view : seen) {
    plan.set_relevant(find_relevant_updates(volume, {{view.range, Refine::boundary}}, Distances::none));
    plan.set_lod(view.view);
    const RangeRequest shown{{view.range}, {}};
    EXPECT_TRUE(client->show(shown));
    for (int i = 0; i < view.batches; ++i) {
      const auto batch = plan.next(1024);
      if (!batch) break;
      EXPECT_TRUE(client->apply(batch->payload, 0, shown));
    }
  }
  return std::move(*client);
}

TEST(VerifyMeshes, AClientThatSawOtherRangesHasAllOfItsLastViewAndNothingWrong) {
  const auto volume = testing::build_shared(testing::gyroid({13, 9, 11}), {.range = {-2, 2}, .refine = Refine::uniform});
  const Range first{-0.3, 0.2}, last{-0.1, 0.5};
  const Lod coarse{.error = 0.2}, fine{.error = 0.02};
  const StreamClient whole = streamed(volume, {{last, {}}}), fresh = streamed(volume, {{last, coarse}});
  const StreamClient client = streamed(volume, {{first, fine}, {last, coarse}});
  EXPECT_TRUE(is_mesh_of_range(whole.front(), &fresh.front(), client.front()));
  EXPECT_FALSE(are_equal(client.mesh(), fresh.mesh())) << "it has more, of the first range";
  const StreamClient less = streamed(volume, {{first, fine}, {last, coarse, 0}});
  EXPECT_FALSE(is_mesh_of_range(whole.front(), &fresh.front(), less.front()));
  EXPECT_TRUE(is_mesh_of_range(whole.front(), nullptr, less.front()));
  const StreamClient other = streamed(volume, {{last, coarse}, {first, coarse}});
  EXPECT_FALSE(is_mesh_of_range(whole.front(), nullptr, other.front()));
}

TEST(VerifyMeshes, NumbersOfPointsAndTetrahedraDoNotMatter) {
  const Mesh mesh = streamed(volume_of_range({-0.3, 0.2}), 1000).mesh();
  std::mt19937 random(1);
  std::vector<std::uint32_t> place(mesh.points.size());
  for (std::uint32_t i = 0; i < place.size(); ++i) place[i] = i;
  std::shuffle(place.begin(), place.end(), random);
  Mesh shuffled = mesh;
  for (std::uint32_t i = 0; i < place.size(); ++i) {
    shuffled.points[place[i]] = mesh.points[i];
    shuffled.surface[place[i]] = mesh.surface[i];
  }
  for (auto& tet : shuffled.tets) {
    for (auto& point : tet) point = place[point];
  }
  std::shuffle(shuffled.tets.begin(), shuffled.tets.end(), random);
  EXPECT_TRUE(are_equal(mesh, shuffled));

  Mesh other = shuffled;
  other.points[7][1] += 1e-9;
  EXPECT_FALSE(are_equal(mesh, other));
  other = shuffled;
  other.tets[3] = other.tets[4];
  EXPECT_FALSE(are_equal(mesh, other));
  other = shuffled;
  other.tets.pop_back();
  EXPECT_FALSE(are_equal(mesh, other));
}

}  // namespace
}  // namespace intervale
