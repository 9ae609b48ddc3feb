// What several ranges need together.
#include "common/ivm/relevant_updates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "common/ivm/refinement.h"
#include "common/ivm/relevant_slots.h"
#include "common/ivm/value_bounds.h"
#include "common/ranges/find_relevant_updates.h"
#include "common/util/bits.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/needs.h"

namespace intervale {
namespace {

constexpr std::array<testing::Dims, 4> kRelevantBoxes{{{17, 17, 17}, {24, 17, 20}, {40, 9, 20}, {30, 5, 11}}};

using Each = std::vector<std::shared_ptr<const RelevantUpdates>>;

class United : public ::testing::TestWithParam<unsigned> {
 protected:
  // One to four ranges within the data set's, or its own.
  [[nodiscard]] Each random_ranges() {
    Each each;
    for (unsigned count = 1 + random_() % kMaxRanges; count > 0; --count) {
      double low = std::uniform_real_distribution(-1.5, 1.5)(random_), high = std::uniform_real_distribution(-1.5, 1.5)(random_);
      if (low > high) std::swap(low, high);
      const ShownRange shown{{low, high}, Refine(random_() % 2)};
      each.push_back(find_relevant_updates(volume_, {random_() % 5 == 0 ? volume_->description().whole() : shown}, Distances(random_() % 3)));
    }
    return each;
  }

  [[nodiscard]] static ShownRanges shown_by(const Each& each) {
    ShownRanges shown;
    for (const auto& one : each) shown.insert(shown.end(), one->shown().begin(), one->shown().end());
    return distinct(shown);
  }

  // What is known of bricks and supercubes bounds all that is relevant in them.
  void expect_bounds(const RelevantUpdates& all) {
    const SupercubeSet& set = volume_->set();
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      const RelevantUpdates::Bound bound = all.bound(b);
      const BrickNeeds needs = all.brick(b);
      ASSERT_LE(bound.updates, set.updates(b));
      unsigned relevant = 0;
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        const std::size_t n = testing::number_in_brick(*volume_, b, s);
        unsigned step = 0, slope = 0, distance = 0;
        const auto known = needs.of_supercube(n, testing::slots_of(all, *volume_, b, s));
        for (const Slot slot : set_bits<Slot>(testing::slots_of(all, *volume_, b, s))) {
          ASSERT_EQ(known(slot).slope, testing::slope_of(all, *volume_, set.place_in(b, s, key, slot)));
          ASSERT_EQ(known(slot).distance, testing::distance_of(all, *volume_, set.place_in(b, s, key, slot)));
          const Place p = set.place_in(b, s, key, slot);
          ++relevant;
          step = std::max(step, volume_->error_step(p.index));
          slope = std::max(slope, testing::slope_of(all, *volume_, p));
          distance = std::max<unsigned>(distance, testing::distance_of(all, *volume_, p));
          ASSERT_GE(bound.object_error, testing::object_error_of(all, *volume_, p) * (1 - 1e-5F));
        }
        ASSERT_EQ(needs.highest(n).error_step, step);
        ASSERT_EQ(needs.highest(n).slope, slope);
        ASSERT_EQ(needs.highest(n).distance, distance);
        for (std::uint64_t some : {testing::slots_of(all, *volume_, b, s), testing::slots_of(all, *volume_, b, s) & random_()}) {
          std::uint8_t farthest = 0;
          for (const Slot slot : set_bits<Slot>(some)) farthest = std::max(farthest, known(slot).distance);
          ASSERT_EQ(needs.farthest(n, testing::slots_of(all, *volume_, b, s), some), farthest);
        }
        ASSERT_GE(bound.error_step, step);
        ASSERT_GE(bound.slope, slope);
      });
      ASSERT_GE(needs.updates(), relevant);
      ASSERT_GE(bound.updates, relevant);
    }
  }

  std::mt19937 random_{GetParam()};
  std::shared_ptr<const IntervalVolume> volume_ =
      testing::build_shared(testing::gyroid(kRelevantBoxes[GetParam() % kRelevantBoxes.size()]), {.range = {-1.5, 1.5}, .refine = Refine::uniform});
};

TEST_P(United, IsWhatEachRangeNeeds) {
  const SupercubeSet& set = volume_->set();
  for (int trial = 0; trial < 4; ++trial) {
    const Each each = random_ranges();
    const RelevantUpdates all = united(*volume_, each, shown_by(each));
    const bool has_slopes = std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_slopes(); });
    ASSERT_EQ(all.has_slopes(), has_slopes);
    const bool has_distances = std::any_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); });
    ASSERT_EQ(all.has_distances(), has_distances);
    const bool all_have_distances = std::all_of(each.begin(), each.end(), [](const auto& one) { return one->has_distances(); });
    set.for_each_down([&](const Place& p) {
      const auto relevant_to = [&](const auto& one) { return testing::is_relevant(*one, *volume_, p); };
      ASSERT_EQ(testing::is_relevant(all, *volume_, p), std::any_of(each.begin(), each.end(), relevant_to));
      unsigned slope = 0;
      for (const auto& one : each) slope = std::max(slope, testing::slope_of(*one, *volume_, p));
      ASSERT_EQ(testing::slope_of(all, *volume_, p), has_slopes ? slope : 0);
      if (!testing::is_relevant(all, *volume_, p)) return;
      const auto error = [&](const RelevantUpdates& of) { return testing::object_error_of(of, *volume_, p); };
      float farthest = 0;
      for (const auto& one : each) farthest = std::max(farthest, relevant_to(one) ? error(*one) : 0);
      ASSERT_GE(error(all), farthest * (1 - 1e-5F));
      if (all_have_distances) {
        ASSERT_LE(error(all), farthest * 1.0906F) << "more than one of its steps longer";
      }
      // What is refined inside has no distances of its own: it is wanted as far as errors tell.
      const bool is_told_by_error =
          has_distances && std::any_of(each.begin(), each.end(), [&](const auto& one) { return !one->has_distances() && relevant_to(one); });
      if (is_told_by_error) {
        const ErrorToDistance code = testing::to_distance_of(all, *volume_, p.brick, p.supercube);
        ASSERT_GE(error(all), all.object_error(code, scale_of_key(p.key), volume_->error_step(p.index)) * (1 - 1e-5F));
      }
    });
    expect_bounds(all);
    for (const auto& one : each) expect_bounds(*one);
  }
}

TEST_P(United, OrderAndRepetitionDoNotMatter) {
  Each each = random_ranges();
  const RelevantUpdates one = united(*volume_, each, shown_by(each));
  std::shuffle(each.begin(), each.end(), random_);
  each.push_back(each.front());
  const RelevantUpdates other = united(*volume_, each, shown_by(each));
  EXPECT_EQ(one.shown(), other.shown());
  EXPECT_EQ(testing::slots_of(one, *volume_), testing::slots_of(other, *volume_));
  const auto codes = testing::error_to_distance_of(one, *volume_), others = testing::error_to_distance_of(other, *volume_);
  EXPECT_TRUE(std::ranges::equal(codes, others, {}, &ErrorToDistance::code, &ErrorToDistance::code));
}

TEST_P(United, APartHasWhatCounts) {
  const SupercubeSet& set = volume_->set();
  PartFinder finder(*volume_);
  for (const Refine refine : {Refine::boundary, Refine::uniform}) {
    const double alpha = std::uniform_real_distribution(-1.5, 1.5)(random_);
    const ShownRange shown{{alpha, alpha + 0.3}, refine};
    SplitSet expected(set);
    const auto counts_itself = [&](const Place& p) { return testing::counts_naively(*volume_, shown, p); };
    set.for_each_up([&](const Place& p) {
      if (counts_itself(p)) expected.insert(p);
    });
    const SplitSet closed = select(set, counts_itself);
    const RelevantSlots slots(*volume_, shown);
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      const std::vector<std::uint64_t> words = slots.with_ancestors(b);
      std::size_t n = 0;
      set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey key) { ASSERT_EQ(words[n++], closed.slots(b, key)); });
    }
    for (const Distances distances : {Distances::none, Distances::estimated}) {
      const auto found = finder.find({shown, distances});
      // In any order of bricks.
      std::vector<std::uint32_t> bricks(set.bricks().size());
      std::iota(bricks.begin(), bricks.end(), 0U);
      std::shuffle(bricks.begin(), bricks.end(), random_);
      for (const std::uint32_t b : bricks) {
        set.for_each_in_brick(BrickIndex(b), ~std::uint64_t(0), [&](const Place& p) {
          ASSERT_EQ(testing::is_relevant(*found, *volume_, p), expected.contains(p)) << "scale " << scale_of_key(p.key);
        });
      }
      expect_bounds(*found);
    }
  }
}

// Of the same updates, whatever is known of distances; estimates are mostly near what is measured.
TEST(FindRelevantUpdates, EstimatesDistancesAndSlopes) {
  std::vector<double> octaves;
  std::map<unsigned, std::vector<unsigned>> by_measured;  // slopes
  for (const double alpha : {-0.8, -0.2, 0.1, 0.5}) {
    const auto volume = testing::build_shared(testing::gyroid({40, 33, 36}), {.range = {-1.5, 1.5}, .refine = Refine::uniform});
    const ShownRange part{{alpha, std::numeric_limits<double>::infinity()}, Refine::boundary};
    PartFinder finder(*volume);
    const auto measured = finder.find({part, Distances::measured}), estimated = finder.find({part, Distances::estimated});
    EXPECT_TRUE(estimated->has_slopes() && estimated->has_distances());
    volume->set().for_each_down([&](const Place& p) {
      ASSERT_EQ(testing::is_relevant(*estimated, *volume, p), testing::is_relevant(*measured, *volume, p));
      const unsigned slope = testing::slope_of(*estimated, *volume, p);
      const float as_estimated = testing::object_error_of(*estimated, *volume, p), as_measured = testing::object_error_of(*measured, *volume, p);
      ASSERT_LE(slope, scale_of_key(p.key) > kTopScale ? kMaxSlope : kMaxSlope - 1);
      if (scale_of_key(p.key) > 0 || as_measured == 0 || as_estimated == 0) return;
      octaves.push_back(std::log2(as_estimated / as_measured));
      by_measured[testing::slope_of(*measured, *volume, p)].push_back(slope);
    });
  }
  std::sort(octaves.begin(), octaves.end());
  ASSERT_GT(octaves.size(), 10000u);
  EXPECT_NEAR(octaves[octaves.size() / 2], 0, 1);
  EXPECT_LT(octaves[octaves.size() * 99 / 100], 5);
  double before = 0;
  for (unsigned slope = 1; slope <= 8; ++slope) {  // steeper ones are mostly so for their descendants
    const std::vector<unsigned>& of = by_measured[slope];
    const double mean = std::accumulate(of.begin(), of.end(), 0.0) / double(of.size());
    EXPECT_GT(mean, before) << "of slope " << slope;
    before = mean;
  }
}

// No step is below what it stands for, and none above by more than an eighth of an octave.
TEST(DistanceOfAnUpdate, IsRoundedUpToTheNextStep) {
  EXPECT_EQ(distance_at_least(0, 3), 0);
  EXPECT_EQ(distance_of(0, 3), 0);
  EXPECT_EQ(distance_at_least(1e300, 3), 255);
  EXPECT_FLOAT_EQ(distance_of(255, 3), 3 * kMaxFarDeviation);
  for (const double width : {1e-30, 2.0, 3e20}) {
    for (double distance = 1e-6; distance < 64; distance *= 1.01) {
      const std::uint8_t step = distance_at_least(distance * width, width);
      EXPECT_GE(double(distance_of(step, width)), distance * width * (1 - 1e-4));
      EXPECT_LT(double(distance_of(std::uint8_t(step - 1), width)), distance * width * (1 + 1e-4));
    }
    for (unsigned step = 1; step < 256; ++step) EXPECT_EQ(distance_at_least(double(distance_of(std::uint8_t(step), width)), width), step);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, United, ::testing::Range(0u, 8u));

// Of all pairs of codes, at every scale: the least code that bounds both, as far as its steps allow.
TEST(ErrorToDistance, TheFartherOfTwoBoundsBoth) {
  const auto distance = [](ErrorToDistance code, int scale, float error) {
    return std::min(error * code.ratio(1), code.is_far() ? kMaxFarDeviation : float(1 << scale));
  };
  for (int scale = 0; scale < 12; ++scale) {
    for (unsigned a = 0; a < 256; a += 3) {
      for (unsigned b = 0; b < 256; b += 5) {
        const ErrorToDistance first{std::uint8_t(a)}, second{std::uint8_t(b)};
        const ErrorToDistance farther = ErrorToDistance::farther(first, second, scale);
        ASSERT_EQ(farther.code(), ErrorToDistance::farther(second, first, scale).code());
        for (const float error : {1e-5F, 0.1F, 1.0F, 300.0F}) {
          const float both = std::max(distance(first, scale, error), distance(second, scale, error));
          ASSERT_GE(distance(farther, scale, error), both) << a << " " << b << " " << scale;
          if (first.is_far() == second.is_far()) {
            ASSERT_EQ(distance(farther, scale, error), both);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace intervale
