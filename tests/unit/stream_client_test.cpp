#include "client/core/stream_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <random>

#include "common/ivm/extraction.h"
#include "common/selection/stream_plan.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using testing::broken_law;
using testing::canonical;

constexpr std::size_t kBatchBytes = 4096;

constexpr std::array<testing::Dims, 4> kClientBoxes{{{9, 9, 9}, {12, 7, 10}, {22, 2, 11}, {13, 13, 6}}};

std::shared_ptr<const IntervalVolume> client_volume(unsigned seed) {
  auto trial = testing::trial_of_seed(seed, kClientBoxes);
  if (seed % 5 == 0) trial.options.range.beta = kInf;
  if (seed % 5 == 1) trial.options.range.beta = trial.options.range.alpha;
  return testing::build_shared(testing::stretched(trial.volume), trial.options);
}

std::string broken(const StreamClient& client) {
  const Description& d = client.description();
  return broken_law(client.mesh(), d.grid, d.range.alpha == d.range.beta);
}

StreamClient started(const Description& description, std::optional<std::uint64_t> max_tets = {}) {
  auto client = StreamClient::start(description, {.max_tets = max_tets.value_or(UINT64_MAX)});
  EXPECT_TRUE(client) << client.error().message;
  return std::move(*client);
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<void> apply_exact(StreamClient& client, const std::vector<std::uint8_t>& payload) {
  const auto exact = std::make_unique<std::uint8_t[]>(payload.size());
  std::copy(payload.begin(), payload.end(), exact.get());
  return client.apply({exact.get(), payload.size()});
}

// Streams a level of detail to its end; the mesh holds its laws after every batch.
void stream(StreamPlan& plan, StreamClient& client, const Lod& lod, int batches = std::numeric_limits<int>::max()) {
  plan.set_lod(lod);
  double remaining = kInf;
  while (batches-- > 0) {
    const auto batch = plan.next(kBatchBytes);
    if (!batch) break;
    ASSERT_LE(plan.remaining().error, remaining);
    remaining = plan.remaining().error;
    const auto applied = apply_exact(client, batch->payload);
    ASSERT_TRUE(applied) << applied.error().message;
    ASSERT_EQ(broken(client), "") << "after " << client.updates() << " updates";
    ASSERT_EQ(client.tet_count(), client.mesh().tets.size());
    ASSERT_EQ(client.updates(), plan.sent());
  }
}

class Stream : public ::testing::TestWithParam<unsigned> {
 protected:
  std::shared_ptr<const IntervalVolume> volume = client_volume(GetParam());
  StreamPlan plan{volume};
};

TEST_P(Stream, EndsWithTheExtractedMesh) {
  StreamClient client = started(volume->description());
  EXPECT_EQ(broken(client), "");
  ASSERT_NO_FATAL_FAILURE(stream(plan, client, {}));
  EXPECT_EQ(canonical(client.mesh()), canonical(extract(*volume, {})->front.mesh()));
  EXPECT_EQ(client.updates(), volume->size());
  EXPECT_EQ(client.tet_count(), volume->description().full.tets);
  EXPECT_EQ(client.mesh().points.size(), volume->description().full.vertices);
}

TEST_P(Stream, EveryLevelOfDetailEndsWithItsMesh) {
  std::mt19937 random(GetParam());
  const Grid& g = volume->description().grid;
  for (int kind = 0; kind < 4; ++kind) {
    Lod lod;
    if (kind == 0) lod.error_percent = double(random() % 60);
    if (kind == 1) lod.error = volume->description().max_error / 4;
    if (kind == 2) lod.max_updates = random() % (volume->size() + 1);
    if (kind == 3) {
      Box box;
      for (int i = 0; i < 3; ++i) {
        box.min[i] = g.affine.origin()[i] + g.affine.spacing()[i] * double(random() % std::uint32_t(g.dims[i]));
        box.max[i] = box.min[i] + g.affine.spacing()[i] * 3;
      }
      lod.roi = box;
    }
    StreamPlan fresh(volume);
    StreamClient client = started(volume->description());
    ASSERT_NO_FATAL_FAILURE(stream(fresh, client, lod));
    const auto expected = extract(*volume, lod);
    ASSERT_TRUE(expected) << expected.error().message;
    EXPECT_EQ(client.updates_in_mesh(), expected->updates);
    EXPECT_EQ(canonical(client.mesh()), canonical(expected->front.mesh())) << "kind " << kind;
  }
}

// A batch that came twice would be refused: what is asked for in the middle never makes the plan send anything again.
TEST_P(Stream, ChangesOfMindKeepTheMeshWhole) {
  std::mt19937 random(GetParam());
  const Grid& g = volume->description().grid;
  StreamClient client = started(volume->description());
  for (int view = 0; view < 6; ++view) {
    Lod lod;
    lod.error_percent = double(random() % 30);
    Box box;
    for (int i = 0; i < 3; ++i) {
      box.min[i] = g.affine.origin()[i] + g.affine.spacing()[i] * double(random() % std::uint32_t(g.dims[i]));
      box.max[i] = box.min[i] + g.affine.spacing()[i] * 4;
    }
    if (view % 2 == 0) lod.roi = box;
    ASSERT_NO_FATAL_FAILURE(stream(plan, client, lod, 1 + int(random() % 2)));
  }
  ASSERT_NO_FATAL_FAILURE(stream(plan, client, {}));
  EXPECT_EQ(canonical(client.mesh()), canonical(extract(*volume, {})->front.mesh()));
}

TEST_P(Stream, TheBudgetHoldsAndWhatFollowsIsKept) {
  const std::uint64_t coarse = started(volume->description()).tet_count(), full = volume->description().full.tets;
  for (const double share : {0.0, 0.01, 0.3, 0.7, 1.0}) {
    const auto most = coarse + std::uint64_t(double(full - std::min(full, coarse)) * share);
    StreamPlan fresh(volume);
    StreamClient client = started(volume->description(), most);
    ASSERT_NO_FATAL_FAILURE(stream(fresh, client, {}));
    EXPECT_LE(client.tet_count(), most);
    EXPECT_EQ(client.updates(), volume->size());
    EXPECT_EQ(client.over_budget(), client.updates_in_mesh() < volume->size());
  }
  if (coarse > 0) {
    EXPECT_TRUE(started(volume->description(), coarse - 1).over_budget()) << "the root's patch alone is too much";
  }
}

TEST_P(Stream, DamagedAndRepeatedBatchesAreRefused) {
  plan.set_lod({});
  const auto first = plan.next(kBatchBytes);
  ASSERT_TRUE(first);
  StreamClient client = started(volume->description());
  ASSERT_TRUE(apply_exact(client, first->payload));
  EXPECT_FALSE(apply_exact(client, first->payload)) << "a second time";
  for (std::size_t cut = 1; cut < 40; ++cut) {
    StreamClient again = started(volume->description());
    EXPECT_FALSE(apply_exact(again, {first->payload.begin(), first->payload.end() - std::ptrdiff_t(cut)}));
  }
  if (const auto second = plan.next(kBatchBytes)) {
    StreamClient again = started(volume->description());
    EXPECT_FALSE(apply_exact(again, second->payload)) << "without the first";
  }
}

INSTANTIATE_TEST_SUITE_P(Random, Stream, ::testing::Range(0u, 10u));

TEST(StreamClient, ADescriptionThatCannotBeIsRefused) {
  const Description good = client_volume(0)->description();
  ASSERT_TRUE(StreamClient::start(good));
  const struct {
    const char* what;
    void (*spoil)(Description&);
  } cases[] = {
      {"a side of 1 sample", [](Description& d) { d.grid.dims[0] = 1; }},
      {"a side of 0", [](Description& d) { d.grid.dims[1] = 0; }},
      {"a negative side", [](Description& d) { d.grid.dims[2] = std::numeric_limits<std::int32_t>::min(); }},
      {"a side that is too long", [](Description& d) { d.grid.dims[0] = kMaxSide + 1; }},
      {"no spacing", [](Description& d) { d.grid.affine.rows[0] = 0; }},
      {"an affine into a plane", [](Description& d) { d.grid.affine.rows = {1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0}; }},
      {"infinite spacing", [](Description& d) { d.grid.affine.rows[10] = kInf; }},
      {"spacing that is no number", [](Description& d) { d.grid.affine.rows[0] = kNan; }},
      {"an infinite origin", [](Description& d) { d.grid.affine.rows[3] = -kInf; }},
      {"an origin that is no number", [](Description& d) { d.grid.affine.rows[11] = kNan; }},
      {"a far corner beyond all numbers", [](Description& d) { d.grid.affine.rows[5] = std::numeric_limits<double>::max(); }},
      {"a corner's key beyond the last", [](Description& d) { d.corners[7] = d.format.last + 1; }},
      {"a last key below the corners'", [](Description& d) { d.format.last = *std::max_element(d.corners.begin(), d.corners.end()) - 1; }},
      {"a negative step", [](Description& d) { d.format.step = -1; }},
      {"a step that is no number", [](Description& d) { d.format.step = kNan; }},
      {"an infinite step", [](Description& d) { d.format.step = kInf; }},
      {"no step for whole numbers",
       [](Description& d) {
         d.format = {SampleType::u8, 0, 0, d.format.last};
       }},
      {"a first value beyond all numbers", [](Description& d) { d.format.first = std::numeric_limits<std::int64_t>::max(); }},
      {"a range upside down",
       [](Description& d) {
         d.range = {1, 0};
       }},
      {"a range that is no number", [](Description& d) { d.range.alpha = kNan; }},
      {"an error that is no number", [](Description& d) { d.max_error = kNan; }},
      {"a negative error", [](Description& d) { d.max_error = -1; }},
  };
  for (const auto& c : cases) {
    Description d = good;
    c.spoil(d);
    const auto client = StreamClient::start(d);
    EXPECT_FALSE(client) << c.what;
    if (!client) {
      EXPECT_EQ(client.error().message.find('\n'), std::string::npos);
    }
  }
}

TEST(StreamClient, TheLargestBoxCostsNothingBeforeItsFirstUpdate) {
  Description d;
  d.grid.dims = {kMaxSide, kMaxSide, kMaxSide};
  d.format.last = 255;
  d.range = {10, 20};
  d.corners.fill(15);
  const StreamClient client = started(d);
  EXPECT_EQ(client.tet_count(), 6u);
  EXPECT_EQ(broken(client), "");
}

}  // namespace
}  // namespace intervale
