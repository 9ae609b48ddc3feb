#include "common/selection/stream_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/ivm/refinement.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/batches.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/needs.h"
#include "tests/support/parents.h"
#include "tests/support/ranks.h"

namespace intervale {
namespace {

constexpr std::size_t kPlanBatchBytes = 4096;

// The last one has bricks of several runs.
constexpr std::array<testing::Dims, 4> kPlanBoxes{{{17, 17, 17}, {24, 17, 20}, {30, 2, 11}, {1040, 2, 3}}};

std::shared_ptr<const IntervalVolume> plan_volume(unsigned seed) {
  const auto trial = testing::trial_of_seed(seed, kPlanBoxes);
  return testing::build_shared(trial.volume, trial.options);
}

Lod plan_lod(const IntervalVolume& v, std::mt19937& random) {
  Lod lod;
  if (random() % 2 == 0) lod.error_percent = double(random() % 40);
  if (random() % 3 == 0) lod.max_updates = random() % (v.size() + 10);
  if (random() % 2 == 0) {
    Box box;
    for (int i = 0; i < 3; ++i) {
      box.min[i] = double(random() % std::uint32_t(v.description().grid.dims[i]));
      box.max[i] = box.min[i] + double(random() % 5);
    }
    lod.roi = box;
  }
  if (random() % 2 == 0) {
    lod.camera.emplace();
    for (int i = 0; i < 3; ++i) {
      lod.camera->eye[i] = double(random() % 100) - 40;
      lod.camera->look_at[i] = double(random() % std::uint32_t(v.description().grid.dims[i])) + 0.25;
    }
    lod.camera->up = {1, 0.5, 0.25};
    lod.camera->viewport = {640, 480};
    lod.camera->pixel_error = double(1 + random() % 64);
  }
  return lod;
}

// What was sent, as a front that takes every batch tells it; and what is left.
class Receiver {
 public:
  explicit Receiver(std::shared_ptr<const IntervalVolume> volume)
      : volume_(std::move(volume)), front_(root_front(volume_->description())), sent_(volume_->size()) {}

  void set_lod(const Lod& lod) {
    wanted_ = in_order(*volume_, select(*volume_, lod), lod);
    if (lod.max_updates && wanted_.size() > *lod.max_updates) wanted_.resize(*lod.max_updates);
    // The last ones within the budget may be ancestors of what is not: those would change no mesh.
    std::vector<bool> needed(volume_->size());
    for (std::size_t k = wanted_.size(); k-- > 0;) {
      const Place p = volume_->set().place(wanted_[k]);
      if (testing::is_relevant(volume_->relevant(), *volume_, p)) needed[p.index] = true;
      if (needed[p.index]) testing::for_each_parent(volume_->set(), p, [&](UpdateIndex parent) { needed[parent] = true; });
    }
    std::erase_if(wanted_, [&](UpdateIndex i) { return !needed[i]; });
  }
  // Takes a batch; what was sent before, or before its parents, is refused.
  Result<std::uint64_t> take(const Batch& batch) {
    auto applied = testing::apply_to(front_, volume_->description(), batch.payload);
    // A diamond whose parents are all split is in the front, or split.
    volume_->set().for_each_down([&](const Place& p) {
      if (sent_[p.index]) return;
      const Diamond d(SupercubeSet::centre(p));
      for (int k = 0; k < d.row->parents; ++k) {
        const Vertex c = d.parent(k);
        if (c.x < 0 || c.y < 0 || c.z < 0) continue;
        if (const auto parent = volume_->set().find(c); parent && !sent_[parent->index]) return;
      }
      sent_[p.index] = !front_.find(d.centre);
    });
    return applied;
  }
  [[nodiscard]] std::vector<UpdateIndex> left() const {
    std::vector<UpdateIndex> left;
    std::copy_if(wanted_.begin(), wanted_.end(), std::back_inserter(left), [this](UpdateIndex i) { return !sent_[i]; });
    return left;
  }
  // Of what is left and wanted for its own sake.
  struct Own {
    std::uint64_t updates = 0;
    double error = 0;
  };
  [[nodiscard]] Own own_left(const Lod& lod) const {
    const Ranking ranking(*volume_, lod);
    Own own;
    for (UpdateIndex i : left()) {
      const Place p = volume_->set().place(i);
      if (!testing::is_relevant(volume_->relevant(), *volume_, p)) continue;
      if (testing::rank_of(*volume_, ranking, p) == 0) continue;
      ++own.updates;
      own.error = std::max(own.error, double(volume_->error(i)));
    }
    return own;
  }
  [[nodiscard]] std::uint64_t sent() const { return std::uint64_t(std::count(sent_.begin(), sent_.end(), true)); }

 private:
  std::shared_ptr<const IntervalVolume> volume_;
  Front front_;
  std::vector<UpdateIndex> wanted_;
  std::vector<bool> sent_;
};

class Plan : public ::testing::TestWithParam<unsigned> {};

TEST_P(Plan, SendsEveryWantedUpdateOnceWhateverViewsFollow) {
  const auto volume = plan_volume(GetParam());
  std::mt19937 random(GetParam());
  StreamPlan plan(volume);
  Receiver receiver(volume);
  EXPECT_FALSE(plan.next(kPlanBatchBytes)) << "nothing is wanted yet";
  Lod lod;
  for (int view = 0; view < 16; ++view) {
    if (lod.camera && random() % 2 == 0) {  // it moves a little
      for (double& x : lod.camera->eye) x += double(random() % 100) / 25 - 2;
    } else {
      lod = plan_lod(*volume, random);
    }
    if (view == 15) lod = {};
    std::optional<DepthMap> hidden;
    if (lod.camera && random() % 2 == 0) {
      hidden = DepthMap{2, 2, 1, 100, {}};
      for (int cell = 0; cell < 4; ++cell) hidden->codes.push_back(std::uint8_t(random()));
    }
    std::optional<Camera> ahead;
    if (lod.camera && random() % 2 == 0) ahead = testing::random_camera(volume->description().grid, random);
    plan.set_lod(lod, hidden ? &*hidden : nullptr, ahead ? &*ahead : nullptr);
    receiver.set_lod(lod);
    ASSERT_GE(plan.remaining().updates, receiver.own_left(lod).updates);
    for (int batches = view == 15 ? 100000 : int(random() % 4); batches > 0; --batches) {
      const std::size_t most = std::size_t(256) << random() % 8;
      const std::uint32_t visits = 1 + std::uint32_t(random()) % (random() % 2 == 0 ? 64 : StreamPlan::kMostVisits);
      const auto left = receiver.left();
      auto batch = plan.next(most, visits);
      while (!batch && !plan.done()) batch = plan.next(most, visits);  // a slice of the search each
      ASSERT_EQ(batch.has_value(), !left.empty());
      if (!batch) {
        ASSERT_TRUE(plan.done());
        ASSERT_EQ(plan.remaining().updates, 0u);
        ASSERT_EQ(plan.remaining().error, 0.0);
        break;
      }
      ASSERT_GT(batch->updates, 0u);
      ASSERT_LE(batch->payload.size(), most);
      const auto before = receiver.sent();
      const auto applied = receiver.take(*batch);
      ASSERT_TRUE(applied) << applied.error().message;
      ASSERT_EQ(*applied, batch->updates);
      ASSERT_EQ(receiver.sent(), before + batch->updates);
      ASSERT_EQ(receiver.left().size() + batch->updates, left.size()) << "all of it is wanted";
      ASSERT_GE(plan.remaining().updates, receiver.own_left(lod).updates);
      ASSERT_GE(plan.remaining().error, receiver.own_left(lod).error);
      ASSERT_EQ(plan.remaining().pixels > 0, lod.camera && !plan.done());
      ASSERT_EQ(plan.sent(), receiver.sent());
    }
  }
  EXPECT_EQ(plan.sent(), volume->size());
  EXPECT_FALSE(plan.next(kPlanBatchBytes));
}

// Bands of falling error: half of the updates already leave no more than the error that the plain order leaves after a
// quarter.
TEST_P(Plan, GreatErrorsAreSentEarly) {
  const auto volume = plan_volume(GetParam());
  const auto order = in_order(*volume, select(*volume, {}), {});
  StreamPlan plan(volume);
  plan.set_lod({});
  while (const auto batch = plan.next(kPlanBatchBytes)) {
    if (plan.sent() > 8192 && plan.sent() < order.size()) {
      EXPECT_LE(plan.remaining().error, volume->error(order[plan.sent() / 4])) << plan.sent() << " sent";
    }
  }
}

TEST_P(Plan, RemainingErrorNeverGrowsWithinAView) {
  const auto volume = plan_volume(GetParam());
  StreamPlan plan(volume);
  plan.set_lod({});
  double before = volume->description().max_error, last = before;
  while (const auto batch = plan.next(kPlanBatchBytes)) {
    EXPECT_LE(plan.remaining().error, before);
    before = last = plan.remaining().error;
  }
  EXPECT_EQ(last, 0);
}

TEST_P(Plan, TheSameViewSendsNothingTheSecondTime) {
  const auto volume = plan_volume(GetParam());
  StreamPlan plan(volume);
  Lod lod;
  lod.error_percent = 10;
  plan.set_lod(lod);
  while (plan.next(kPlanBatchBytes)) {
  }
  const auto sent = plan.sent();
  EXPECT_EQ(sent, select(*volume, lod).count());
  plan.set_lod(lod);
  EXPECT_FALSE(plan.next(kPlanBatchBytes));
  lod.error_percent = 20;
  plan.set_lod(lod);
  EXPECT_FALSE(plan.next(kPlanBatchBytes)) << "a coarser view has all it needs";
  EXPECT_EQ(plan.sent(), sent);
}

INSTANTIATE_TEST_SUITE_P(Random, Plan, ::testing::Range(0u, 12u));

TEST(StreamPlan, AVolumeWithoutUpdatesSendsNothing) {
  const auto empty = FieldHierarchy(testing::gyroid({9, 9, 9}), {.range = {50, 60}}).compact();
  ASSERT_TRUE(empty);
  StreamPlan plan(std::make_shared<const IntervalVolume>(*empty));
  plan.set_lod({});
  EXPECT_TRUE(plan.done());
  EXPECT_FALSE(plan.next(kPlanBatchBytes));
}

}  // namespace
}  // namespace intervale
