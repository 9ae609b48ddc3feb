// What several ranges need together.
#include "common/ivm/relevant_updates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "common/ranges/find_relevant_updates.h"
#include "common/util/bits.h"
#include "tests/support/interval_volumes.h"

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
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      unsigned brick_step = 0;
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        const std::uint64_t occupancy = set.occupancy()[s];
        std::uint64_t slots = 0;
        for (const auto& one : each) slots |= one->slots(s, occupancy);
        ASSERT_EQ(all.slots(s, occupancy), slots);
        unsigned most = 0;
        for (const Slot slot : set_bits<Slot>(slots)) most = std::max(most, volume_->error_step(set.first(b, s) + count_below(occupancy, slot)));
        ASSERT_EQ(all.supercube_error_steps()[s], most);
        unsigned steepest = 0;
        for (const Slot slot : set_bits<Slot>(slots)) {
          const UpdateIndex i = set.first(b, s) + count_below(occupancy, slot);
          unsigned slope = 0;
          for (const auto& one : each) slope = std::max(slope, one->slope(i));
          ASSERT_EQ(all.slope(i), has_slopes ? slope : 0);
          steepest = std::max(steepest, all.slope(i));
        }
        ASSERT_EQ(all.supercube_slopes()[s], steepest);
        ASSERT_GE(all.brick_slope(b), steepest);
        brick_step = std::max(brick_step, most);
        std::uint8_t longest = 0;
        for (const Slot slot : set_bits<Slot>(slots)) {
          const UpdateIndex i = set.first(b, s) + count_below(occupancy, slot);
          const auto error = [&](const RelevantUpdates& of) { return of.object_error(s, scale_of_key(key), volume_->error_step(i), of.distance(i)); };
          float farthest = 0;
          for (const auto& one : each) {
            if ((one->slots(s, occupancy) >> slot & 1) != 0) farthest = std::max(farthest, error(*one));
          }
          ASSERT_GE(error(all), farthest * (1 - 1e-5F));
          if (all_have_distances) {
            ASSERT_LE(error(all), farthest * 1.0906F) << "more than one of its steps longer";
          }
          // What is refined inside has no distances of its own: it is wanted as far as errors tell.
          const bool is_told_by_error = has_distances && std::any_of(each.begin(), each.end(), [&](const auto& one) {
                                          return !one->has_distances() && (one->slots(s, occupancy) >> slot & 1) != 0;
                                        });
          if (is_told_by_error) {
            ASSERT_GE(error(all), all.object_error(all.error_to_distance()[s], scale_of_key(key), volume_->error_step(i)) * (1 - 1e-5F));
          }
          ASSERT_GE(all.brick_object_error(b), error(all));
          longest = std::max(longest, all.distance(i));
        }
        ASSERT_EQ(all.supercube_distance(s), longest);
      });
      ASSERT_EQ(all.brick_error_step(b), brick_step);
    }
  }
}

TEST_P(United, OrderAndRepetitionDoNotMatter) {
  Each each = random_ranges();
  const RelevantUpdates one = united(*volume_, each, shown_by(each));
  std::shuffle(each.begin(), each.end(), random_);
  each.push_back(each.front());
  const RelevantUpdates other = united(*volume_, each, shown_by(each));
  EXPECT_EQ(one.shown(), other.shown());
  for (SupercubeIndex s{0}; s < volume_->set().supercubes(); ++s) {
    const std::uint64_t occupancy = volume_->set().occupancy()[s];
    ASSERT_EQ(one.slots(s, occupancy), other.slots(s, occupancy));
    ASSERT_EQ(one.error_to_distance()[s].code(), other.error_to_distance()[s].code());
  }
}

// Of the same updates, whatever is known of distances; estimates are mostly near what is measured.
TEST(FindRelevantUpdates, EstimatesDistances) {
  std::vector<double> octaves;
  for (const double alpha : {-0.8, -0.2, 0.1, 0.5}) {
    const auto volume = testing::build_shared(testing::gyroid({40, 33, 36}), {.range = {-1.5, 1.5}, .refine = Refine::uniform});
    const ShownRange part{{alpha, std::numeric_limits<double>::infinity()}, Refine::boundary};
    PartFinder finder(*volume);
    const auto measured = finder.find({part, Distances::measured}), estimated = finder.find({part, Distances::estimated});
    const SupercubeSet& set = volume->set();
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        ASSERT_EQ(estimated->slots(s, set.occupancy()[s]), measured->slots(s, set.occupancy()[s]));
        if (scale_of_key(key) != 0) return;
        const unsigned step = measured->supercube_error_steps()[s];
        const float as_estimated = estimated->object_error(s, 0, step, 0),
                    as_measured = measured->object_error(s, 0, step, measured->supercube_distance(s));
        if (as_measured > 0 && as_estimated > 0) octaves.push_back(std::log2(as_estimated / as_measured));
      });
    }
  }
  std::sort(octaves.begin(), octaves.end());
  ASSERT_GT(octaves.size(), 1000u);
  EXPECT_NEAR(octaves[octaves.size() / 2], 0, 1);
  EXPECT_LT(octaves[octaves.size() * 99 / 100], 5);
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
