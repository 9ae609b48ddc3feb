// Plans whose ranges change: what is known of unsent updates outlives the ends of ranges that stay.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "common/ranges/find_relevant_updates.h"
#include "common/selection/stream_plan.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

constexpr std::array<double, 5> kEnds{-1, -0.4, 0.1, 0.5, 1.2};

using Shared = std::shared_ptr<const RelevantUpdates>;

// How many bricks were looked at until all is sent, about.
unsigned finish(StreamPlan& plan) {
  unsigned steps = 0;
  for (; !plan.done(); ++steps) (void)plan.next(1 << 16, 1);
  return steps;
}

class PlanOfRanges : public ::testing::TestWithParam<unsigned> {
 protected:
  // Surfaces at each of kEnds, of which ranges share some.
  [[nodiscard]] std::vector<Shared> surfaces(Distances distances) const {
    std::vector<Shared> all;
    all.reserve(kEnds.size());
    for (const double end : kEnds) all.push_back(find_relevant_updates(volume_, {{{end, volume_->description().range.beta}}}, distances));
    return all;
  }

  // Moves one end at least.
  void drag(StreamPlan& plan) {
    if (random_() % 16 == 0) surfaces_ = surfaces(Distances(random_() % 3));
    std::vector<std::size_t> ends = ends_;
    while (ends == ends_ || ends.empty()) {
      if (ends.empty() || (random_() % 3 == 0 && ends.size() < 3)) ends.push_back(random_() % kEnds.size());
      ends[random_() % ends.size()] = random_() % kEnds.size();
      if (random_() % 4 == 0) ends.pop_back();
    }
    ends_ = ends;
    std::vector<Shared> each;
    for (const std::size_t end : ends_) each.push_back(surfaces_[end]);
    relevant_ = std::make_shared<const RelevantUpdates>(united(*volume_, std::move(each), {volume_->description().whole()}));
    plan.set_relevant(relevant_);
  }

  [[nodiscard]] Lod random_lod() {
    Lod lod;
    if (random_() % 4 == 0) lod.error_percent = double(random_() % 40);
    if (random_() % 4 == 0) lod.max_updates = random_() % volume_->size();
    if (random_() % 4 == 0) return lod;
    lod.camera = testing::random_camera(volume_->description().grid, random_);
    lod.camera->pixel_error = double(1 + random_() % 32);
    return lod;
  }

  // A plan that rests: it has what another one has sent, and its range.
  [[nodiscard]] StreamPlan resting(const StreamPlan& plan) const {
    StreamPlan other(volume_);
    other.resume(plan);
    if (relevant_) other.set_relevant(relevant_);
    other.rest();
    return other;
  }

  // Some of what was sent, with all that depends on it.
  void forget_some(StreamPlan& plan) {
    std::vector<SlotGroup> some;
    for (SlotGroup group : plan.held().groups(volume_->set())) {
      group.slots &= random_() & random_();
      if (group.slots != 0 && random_() % 4 == 0) some.push_back(group);
    }
    ASSERT_TRUE(plan.forget(some));
  }

  std::mt19937 random_{GetParam()};
  std::shared_ptr<const IntervalVolume> volume_ =
      testing::build_shared(testing::gyroid({40, 24, 33}), {.range = {-1.5, 1.5}, .refine = Refine::uniform});
  std::vector<Shared> surfaces_ = surfaces(Distances(random_() % 3));
  std::vector<std::size_t> ends_;
  Shared relevant_;  // to the plan; null: all that the data set needs
};

// A plan that rested knows nothing of what it did not send but what follows from its range.
TEST_P(PlanOfRanges, SendsWhatAPlanSendsThatRested) {
  StreamPlan plan(volume_);
  for (int view = 0; view < 24; ++view) {
    if (random_() % 6 == 0) forget_some(plan);
    if (random_() % 5 != 0) drag(plan);
    const Lod lod = random_lod();
    StreamPlan rested = resting(plan);
    rested.set_lod(lod);
    plan.set_lod(lod);
    for (unsigned batches = unsigned(random_() % 4); batches > 0 && !plan.done(); --batches)
      (void)plan.next(std::size_t(256) << random_() % 6, 1 + unsigned(random_() % 4096));
    if (random_() % 2 == 0) continue;  // the next view replaces this one
    (void)finish(plan);
    (void)finish(rested);
    ASSERT_TRUE(plan.held() == rested.held()) << "view " << view;
    ASSERT_EQ(plan.sent(), rested.sent());
    ASSERT_EQ(plan.remaining().updates, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, PlanOfRanges, testing::seeds(0, 12));

// Two surfaces, each across its own part of the volume: one stays, the other moves to and fro.
TEST(PlanOfASurface, LooksAgainOnlyWhereASurfaceMoved) {
  std::vector<float> samples;
  for (int z = 0; z < 17; ++z) {
    for (int y = 0; y < 17; ++y) {
      for (int x = 0; x < 97; ++x) samples.push_back(float(x) / 97 + 0.05F * std::sin(float(x + 2 * y)) * std::cos(float(y - z)));
    }
  }
  const auto volume =
      testing::build_shared(testing::volume_of_type<float>(SampleType::f32, {97, 17, 17}, samples), {.range = {0.1, 0.9}, .refine = Refine::uniform});
  const auto surface = [&](double end) { return find_relevant_updates(volume, {{{end, 0.9}}}, Distances::measured); };
  const Shared stays = surface(0.25), there = surface(0.7), here = surface(0.75);
  Lod lod;
  lod.camera = Camera{.eye = {48, 8, 150}, .look_at = {48, 8, 8}, .up = {0, 1, 0}, .viewport = {1280, 800}, .pixel_error = 2};
  StreamPlan plan(volume);
  const auto show = [&](StreamPlan& in, const Shared& moved) {
    in.set_relevant(std::make_shared<const RelevantUpdates>(united(*volume, {stays, moved}, {volume->description().whole()})));
    in.set_lod(lod);
    return finish(in);
  };
  (void)show(plan, there);
  (void)show(plan, here);
  StreamPlan rested(volume);
  rested.resume(plan);
  rested.rest();
  const unsigned looked_at = show(plan, there), if_rested = show(rested, there);
  EXPECT_GT(looked_at, 0u);
  EXPECT_LT(looked_at, if_rested * 2 / 3);
}

}  // namespace
}  // namespace intervale
