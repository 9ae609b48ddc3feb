#include "client/core/budget.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <deque>
#include <memory>
#include <random>

#include "client/core/stream_client.h"
#include "common/ivm/extraction.h"
#include "common/selection/stream_plan.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

using testing::broken_law;

constexpr std::array<testing::Dims, 4> kBudgetBoxes{{{17, 17, 17}, {24, 17, 20}, {40, 9, 20}, {30, 5, 11}}};

IntervalVolume budget_volume(unsigned seed) { return testing::build(testing::trial_of_seed(seed, kBudgetBoxes)); }

class Budgets : public ::testing::TestWithParam<unsigned> {
 protected:
  IntervalVolume volume_ = budget_volume(GetParam());
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

// Whatever was shown before: within the budget, and a mesh that holds its laws.
TEST_P(Budgets, BalanceShowsWhatMattersMost) {
  Front front = extract(volume_, {})->front;
  const std::uint64_t full = front.tet_count();
  std::uint64_t coarse = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const Importance importance = size_on_screen(testing::random_camera(volume_.description().grid, random_), volume_.description().grid);
    const std::uint64_t most = trial == 0 ? 0 : coarse + std::uint64_t(double(full - std::min(full, coarse)) * testing::uniform(random_, 0, 1.1));
    balance(front, most, importance);
    if (trial == 0) {
      coarse = front.tet_count();
      EXPECT_EQ(front.shown_count(), 0u) << "nothing can be left out any more";
      continue;
    }
    ASSERT_LE(front.tet_count(), most);
    ASSERT_EQ(front.validate(), std::nullopt);
    ASSERT_EQ(broken_law(front.mesh(), volume_.description().grid, false), "");
    if (most >= full) {
      EXPECT_EQ(front.tet_count(), full);
    }
  }
}

// A client that looks around while the stream goes on, and never has more than its budget.
TEST_P(Budgets, NoMeshOnTheWayIsLarger) {
  const auto volume = std::make_shared<const IntervalVolume>(volume_);
  const Grid& g = volume->description().grid;
  const std::uint64_t full = volume->description().full.tets;
  const std::uint64_t most = StreamClient::start(volume->description())->tet_count() + full / 3;
  auto client = StreamClient::start(volume->description(), {.max_tets = most});
  ASSERT_TRUE(client);
  StreamPlan plan(volume);
  for (int view = 0; view < 12; ++view) {
    Lod lod;
    lod.camera = testing::random_camera(g, random_);
    lod.camera->pixel_error = 0.5;
    plan.set_lod(lod);
    client->look(*lod.camera);
    for (int batches = 0; batches < 5; ++batches) {
      const auto batch = plan.next(2048);
      if (!batch) break;
      ASSERT_TRUE(client->apply(batch->payload));
      ASSERT_LE(client->tet_count(), most);
      ASSERT_EQ(client->updates(), plan.sent());
      ASSERT_EQ(client->front().validate(), std::nullopt);
    }
    ASSERT_EQ(broken_law(client->mesh(), g, false), "");
    ASSERT_EQ(client->mesh().tets.size(), client->tet_count());
  }
  // With room enough again everything comes back, without a byte.
  Front all = client->front();
  balance(all, ~std::uint64_t(0), size_on_screen(testing::random_camera(g, random_), g));
  EXPECT_EQ(all.withheld_count(), 0u);
}

// A client with little room looks around, while batches are under way that were made before the server knew what it
// gave up.
TEST_P(Budgets, WhatIsForgottenIsForgottenAtBothEnds) {
  const auto volume = std::make_shared<const IntervalVolume>(volume_);
  const Grid& g = volume->description().grid;
  const Front whole = extract(*volume, {})->front;
  for (const unsigned part : {2u, 6u, 30u}) {
    const Budget budget{.max_tets = volume->description().full.tets * 2 / part, .max_updates = volume->size() / part};
    auto client = StreamClient::start(volume->description(), budget);
    ASSERT_TRUE(client);
    const std::uint64_t most_tets = std::max(client->tet_count(), budget.max_tets);
    StreamPlan plan(volume);
    struct UnderWay {
      Batch batch;
      std::uint64_t epoch;
    };
    std::deque<UnderWay> line;
    const auto receive = [&] {
      ASSERT_TRUE(client->apply(line.front().batch.payload, line.front().epoch));
      line.pop_front();
      ASSERT_LE(client->updates(), budget.max_updates);
      ASSERT_LE(client->tet_count(), most_tets);
    };
    std::uint64_t forgotten = 0, full = 0;
    for (std::uint64_t epoch = 1; epoch <= 30; ++epoch) {
      Lod lod;
      lod.camera = testing::random_camera(g, random_);
      lod.camera->pixel_error = 0.5;
      client->look(*lod.camera);
      const auto given_up = client->give_up(epoch, 8 * part);
      for (const SlotGroup& group : given_up) forgotten += std::uint64_t(std::popcount(group.slots));
      ASSERT_TRUE(plan.forget(given_up));
      plan.set_room(budget.max_updates);
      plan.set_lod(lod);
      const int rounds = int(testing::uniform(random_, 0, 12));
      for (int round = 0; round < rounds; ++round) {
        if (auto batch = plan.next(1024)) line.push_back({std::move(*batch), epoch});
        if (line.empty() || round % 3 == 0) continue;
        ASSERT_NO_FATAL_FAILURE(receive());
      }
      full += plan.is_full();
      ASSERT_LE(plan.sent(), budget.max_updates);
      if (epoch % 5 != 0) continue;
      while (!line.empty()) ASSERT_NO_FATAL_FAILURE(receive());
      client->arrived(epoch);
      ASSERT_EQ(client->updates(), plan.sent());
      ASSERT_EQ(client->front().validate(), std::nullopt);
      ASSERT_TRUE(client->front().is_part_of(whole));
      ASSERT_EQ(broken_law(client->mesh(), g, false), "");
    }
    EXPECT_GT(forgotten, 0u);
    EXPECT_GT(full, 0u);
  }
}

// Where the answer brings nothing, what was hidden takes the room of what was given up.
TEST_P(Budgets, WhatIsGivenUpMakesRoomInTheMesh) {
  const auto volume = std::make_shared<const IntervalVolume>(volume_);
  const Budget budget{.max_tets = volume->description().full.tets * 3 / 4, .max_updates = volume->size()};
  auto client = StreamClient::start(volume->description(), budget);
  ASSERT_TRUE(client);
  StreamPlan plan(volume);
  plan.set_lod({});
  while (const auto batch = plan.next(1 << 16)) ASSERT_TRUE(client->apply(batch->payload, 1));
  const Camera camera = testing::random_camera(volume->description().grid, random_);
  client->look(camera);
  ASSERT_FALSE(client->give_up(2, SIZE_MAX).empty());
  client->arrived(1);
  EXPECT_EQ(client->updates(), volume->size()) << "not yet";
  client->arrived(2);
  EXPECT_LT(client->updates(), volume->size());
  const std::uint64_t shown = client->updates_in_mesh();
  client->look(camera);
  EXPECT_EQ(client->updates_in_mesh(), shown);
}

// What is least goes, and takes no room any more.
TEST_P(Budgets, GivingUpAllButALittleGivesBackTheRoom) {
  Front front = extract(volume_, {})->front;
  const Grid& g = volume_.description().grid;
  const std::size_t before = front.memory_bytes();
  const Importance importance = size_on_screen(testing::random_camera(g, random_), g);
  const std::uint64_t all = front.split_count();
  const auto some = least_important(front, all / 2, SIZE_MAX, importance);
  front.forget(some);
  EXPECT_EQ(front.split_count(), all - all / 2) << "as many as were chosen";
  EXPECT_EQ(front.validate(), std::nullopt);
  EXPECT_EQ(broken_law(front.mesh(), g, false), "");
  front.forget(least_important(front, all, SIZE_MAX, importance));
  EXPECT_EQ(front.split_count(), 0u);
  EXPECT_LT(front.memory_bytes(), before / 4 + 4096);
  EXPECT_EQ(front.validate(), std::nullopt);
}

// A view that comes back finds the mesh that it had.
TEST_P(Budgets, WhatMattersDoesNotDependOnWhereOneWas) {
  Front front = extract(volume_, {})->front;
  const Grid& g = volume_.description().grid;
  const std::uint64_t most = front.tet_count() / 2;
  const Importance here = size_on_screen(testing::random_camera(g, random_), g), there = size_on_screen(testing::random_camera(g, random_), g);
  const auto shown_weight = [&] {
    double sum = 0;
    for (const SlotGroup& group : front.splits()) sum += here(group.key) * std::popcount(front.shown_slots(group.key));
    return sum;
  };
  balance(front, most, here);
  const double first = shown_weight();
  balance(front, most, there);
  balance(front, most, here);
  EXPECT_GE(shown_weight(), 0.9 * first);
}

INSTANTIATE_TEST_SUITE_P(Random, Budgets, testing::seeds(0, 8));

}  // namespace
}  // namespace intervale
