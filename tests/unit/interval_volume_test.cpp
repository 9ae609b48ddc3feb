#include "common/ivm/interval_volume.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/verify.h"
#include "common/patch/key_sides.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <thread>
#include <vector>

#include "common/ivm/value_bounds.h"
#include "common/ranges/surface_deviation.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/needs.h"
#include "tests/support/parents.h"
#include "tests/support/parts.h"

namespace intervale {
namespace {

class IntervalVolumeValidate : public ::testing::Test {
 protected:
  IntervalVolumeValidate() : volume_(testing::gyroid({9, 9, 9})), made_(FieldHierarchy(volume_, {{-0.3, 0.2}}).compact()) {}
  Volume volume_;
  Result<IntervalVolume> made_;
};

TEST_F(IntervalVolumeValidate, PassesWhatWasBuilt) {
  ASSERT_TRUE(made_);
  EXPECT_TRUE(validate(*made_));
  const auto again = IntervalVolume::assemble(testing::parts_of(*made_));
  ASSERT_TRUE(again);
  EXPECT_EQ(again->description(), made_->description());
}

TEST_F(IntervalVolumeValidate, FindsALargestErrorThatIsNone) {
  auto parts = testing::parts_of(*made_);
  parts.description.max_error = 1e6;
  EXPECT_FALSE(validate(*IntervalVolume::assemble(std::move(parts))));
}

TEST_F(IntervalVolumeValidate, FindsAFullMeshOfAnotherSize) {
  auto parts = testing::parts_of(*made_);
  ++parts.description.full.vertices;
  EXPECT_FALSE(validate(*IntervalVolume::assemble(std::move(parts))));
  parts = testing::parts_of(*made_);
  --parts.description.full.tets;
  EXPECT_FALSE(validate(*IntervalVolume::assemble(std::move(parts))));
}

TEST_F(IntervalVolumeValidate, FindsAnErrorGreaterThanItsParents) {
  auto parts = testing::parts_of(*made_);
  parts.steps.back() = std::uint8_t(parts.error_steps.size() - 1);
  parts.steps.front() = 0;
  EXPECT_FALSE(validate(*IntervalVolume::assemble(std::move(parts))));
}

TEST_F(IntervalVolumeValidate, FindsAValueOnAnotherSide) {
  // Nearly every mesh changes its size when a vertex changes its side.
  const Description& d = made_->description();
  const KeySides sides(d.format, d.range);
  int found = 0;
  for (UpdateIndex i{0}; i < 20; ++i) {
    auto parts = testing::parts_of(*made_);
    parts.keys.set(i, sides.side(made_->key(i)) == Side::above ? 0 : d.format.last);
    found += !validate(*IntervalVolume::assemble(std::move(parts)));
  }
  EXPECT_GT(found, 15);
}

TEST(ErrorToDistance, RoundUpByAtMostAStep) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> octaves(-11.8, 18.9), units(-20, 20);
  for (int trial = 0; trial < 10000; ++trial) {
    const double unit = std::exp2(units(random)), ratio = unit * std::exp2(octaves(random));
    const bool is_far = trial % 2 == 0;
    const ErrorToDistance yield = ErrorToDistance::at_least(ratio, unit, is_far);
    EXPECT_EQ(yield.is_far(), is_far);
    const double rounded = yield.ratio(float(unit));
    ASSERT_GE(rounded, ratio * (1 - 1e-6)) << ratio / unit;
    ASSERT_LE(rounded, ratio * std::exp2(is_far ? 1.0 / 2 : 1.0 / 6) * (1 + 1e-6)) << ratio / unit;
  }
}

TEST(ErrorToDistance, EachStandsForItself) {
  for (int step = 1; step < 255; ++step) {
    if (step == 191) continue;  // has no bound
    const bool is_far = step > 191;
    const double ratio = is_far ? 3 * std::exp2((step - 216) / 2.0) : 3 * std::exp2((step - 72) / 6.0);
    EXPECT_EQ(ErrorToDistance::at_least(ratio, 3, is_far).code(), step);
    EXPECT_EQ(ErrorToDistance::at_least(ratio * (1 + 1e-6), 3, is_far).code(), step + 1);
    EXPECT_LT(ErrorToDistance(std::uint8_t(step)).ratio(3), ErrorToDistance(std::uint8_t(step + 1)).ratio(3));
  }
}

TEST(ErrorToDistance, NothingIsNothingAndTheLastOnesHaveNoBound) {
  for (const bool is_far : {false, true}) {
    EXPECT_EQ(ErrorToDistance::at_least(0, 1, is_far).code(), 0);
    EXPECT_EQ(ErrorToDistance::at_least(0, 1, is_far).ratio(1), 0);
    EXPECT_EQ(ErrorToDistance::at_least(1e-300, 1, is_far).code(), is_far ? 192 : 1);
    for (const double ratio : {std::exp2(20.5), 1e300, std::numeric_limits<double>::infinity()})
      EXPECT_EQ(ErrorToDistance::at_least(ratio, 1, is_far).code(), is_far ? 255 : 191);
  }
  for (const int last : {191, 255}) EXPECT_EQ(ErrorToDistance(std::uint8_t(last)).ratio(1e-30f), std::numeric_limits<float>::max());
}

// Fields of several kinds, in boxes that nest and that do not.
class ObjectErrors : public ::testing::TestWithParam<unsigned> {
 protected:
  ObjectErrors() {
    constexpr std::array<std::array<std::int32_t, 3>, 4> shapes{{{17, 17, 17}, {12, 5, 7}, {20, 11, 9}, {40, 3, 4}}};
    const unsigned seed = GetParam();
    switch (seed % 3) {
      case 0:
        volume_ = testing::gyroid(shapes[seed % 4]), range_ = {-0.3, 0.2};
        break;
      case 1:
        volume_ = testing::digits(shapes[seed % 4], seed), range_ = {3, 5};
        break;
      default:
        volume_ = testing::bump(shapes[seed % 4], seed), range_ = {60, 80};
    }
    if (seed % 2 == 1) volume_.grid.affine = Affine::of({0.5, 1, 3});
    auto sigma = FieldHierarchy(volume_, {.range = range_}).compact();
    EXPECT_TRUE(sigma);
    sigma_ = std::move(*sigma);
  }
  Volume volume_;
  Range range_;
  Result<IntervalVolume> sigma_ = fail("not made");
};

TEST_P(ObjectErrors, AreNeverAboveHalfTheDiamondsWidthOrWhatIsFurthest) {
  sigma_->set().for_each_down([&](const Place& p) {
    const double width = diamond_width(volume_.grid) * Diamond(SupercubeSet::centre(p)).h;
    const float error = testing::object_error_of(sigma_->relevant(), *sigma_, p);
    const bool is_far = testing::to_distance_of(sigma_->relevant(), *sigma_, p.brick, p.supercube).is_far();
    ASSERT_LE(error, (is_far ? 64 * diamond_width(volume_.grid) : width) / 2 * (1 + 1e-6));
    ASSERT_GE(error, 0);
    if (testing::is_relevant(sigma_->relevant(), *sigma_, p)) {
      ASSERT_LE(error, sigma_->relevant().bound(p.brick).object_error);
    }
  });
}

TEST_P(ObjectErrors, AreNoLessThanHalfOfWhatWasMeasuredAnywhereBelow) {
  const SupercubeSet& set = sigma_->set();
  std::vector<float> moves = surface_deviation(volume_, range_, sigma_->domain(), set).largest;
  set.for_each_up([&](const Place& p) {
    testing::for_each_parent(set, p, [&](UpdateIndex parent) { moves[parent] = std::max(moves[parent], moves[p.index]); });
  });
  std::size_t told = 0;
  set.for_each_down([&](const Place& p) {
    if (sigma_->error(p.index) == 0) return;  // no factor makes anything of that
    ASSERT_GE(testing::object_error_of(sigma_->relevant(), *sigma_, p), moves[p.index] / 2 * (1 - 1e-5));
    told += moves[p.index] > 0;
  });
  EXPECT_GT(told, 10u);
}

TEST_P(ObjectErrors, OfABrickAreThoseOfOneOfItsUpdates) {
  const SupercubeSet& set = sigma_->set();
  std::vector<float> largest(set.bricks().size());
  set.for_each_down([&](const Place& p) {
    if (!testing::is_relevant(sigma_->relevant(), *sigma_, p)) return;
    largest[p.brick] = std::max(largest[p.brick], testing::object_error_of(sigma_->relevant(), *sigma_, p));
  });
  for (BrickIndex b{0}; b < largest.size(); ++b) EXPECT_EQ(sigma_->relevant().bound(b).object_error, largest[b]);
}

INSTANTIATE_TEST_SUITE_P(Fields, ObjectErrors, ::testing::Range(0u, 12u));

TEST(IntervalVolumeSet, RefusesYieldsThatAreNotOneForEachSupercube) {
  const Volume volume = testing::gyroid({9, 9, 9});
  const auto made = FieldHierarchy(volume, {.range = {-0.3, 0.2}}).compact();
  ASSERT_TRUE(made);
  for (const std::size_t size : {std::size_t(0), made->set().supercubes() - 1, made->set().supercubes() + 1}) {
    auto parts = testing::parts_of(*made);
    parts.surface.to_distance.resize(size);
    EXPECT_FALSE(IntervalVolume::assemble(std::move(parts)));
  }
}

// The set of a larger box is no set of this one.
TEST(IntervalVolumeSet, RefusesScalesThatTheBoxHasNot) {
  const auto large = FieldHierarchy(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}}).compact();
  ASSERT_TRUE(large);
  auto parts = testing::parts_of(*large);
  parts.description.grid.dims = {5, 5, 5};
  EXPECT_FALSE(IntervalVolume::assemble(std::move(parts)));
}

class IntervalVolumeAssemble : public ::testing::TestWithParam<unsigned> {
 protected:
  IntervalVolumeAssemble()
      : volume_(GetParam() == 0 ? testing::gyroid({9, 9, 9}) : testing::digits({7, 4, 11}, 3)),
        made_(with_half_the_errors(FieldHierarchy(volume_, {GetParam() == 0 ? Range{-0.3, 0.2} : Range{3, 5.5}}).compact().value())) {}
  // Fewer distinct errors than there may be.
  static IntervalVolume with_half_the_errors(const IntervalVolume& volume) {
    auto parts = testing::parts_of(volume);
    const std::size_t half = parts.error_steps.size() / 2;
    parts.error_steps.erase(parts.error_steps.begin(), parts.error_steps.begin() + std::ptrdiff_t(half));
    for (auto& step : parts.steps) step = std::uint8_t(std::max<std::size_t>(step, half) - half);
    return IntervalVolume::assemble(std::move(parts)).value();
  }
  template <class Change>
  [[nodiscard]] Result<IntervalVolume> changed(Change change) const {
    auto parts = testing::parts_of(made_);
    change(parts);
    return IntervalVolume::assemble(std::move(parts));
  }
  Volume volume_;
  IntervalVolume made_;
};

using Parts = IntervalVolume::Parts;

TEST_P(IntervalVolumeAssemble, RefusesNumbersThatAreNotTheSets) {
  const std::size_t size = made_.size();
  for (const std::size_t other : {std::size_t(0), size - 1, size + 1}) {
    EXPECT_FALSE(changed([&](Parts& p) { p.keys = ValueKeys(other, p.description.format.last); }));
    EXPECT_FALSE(changed([&](Parts& p) { p.steps.resize(other); }));
  }
}

TEST_P(IntervalVolumeAssemble, RefusesKeysBeyondTheLast) {
  const ValueKey last = made_.description().format.last;
  for (const std::size_t i : {std::size_t(0), std::size_t(made_.size() / 2), std::size_t(made_.size() - 1)}) {
    EXPECT_TRUE(changed([&](Parts& p) { p.keys.set(i, last); }));
    EXPECT_FALSE(changed([&](Parts& p) { p.keys.set(i, last + 1); }));
  }
  for (std::size_t corner = 0; corner < kRootVertices; ++corner) {
    EXPECT_TRUE(changed([&](Parts& p) { p.description.corners[corner] = last; }));
    EXPECT_FALSE(changed([&](Parts& p) { p.description.corners[corner] = last + 1; }));
  }
}

TEST_P(IntervalVolumeAssemble, RefusesErrorStepsThatAreOutOfRange) {
  const std::size_t steps = made_.error_steps().size();
  for (const std::size_t i : {std::size_t(0), std::size_t(made_.size() - 1)}) {
    EXPECT_TRUE(changed([&](Parts& p) { p.steps[i] = std::uint8_t(steps - 1); }));
    for (const std::size_t step : {steps, std::size_t(kMaxErrorSteps - 1)}) {
      EXPECT_FALSE(changed([&](Parts& p) { p.steps[i] = std::uint8_t(step); }));
    }
  }
}

TEST_P(IntervalVolumeAssemble, RefusesErrorsThatDescendOrAreTooManyOrNone) {
  EXPECT_FALSE(changed([](Parts& p) { p.error_steps.clear(); }));
  EXPECT_FALSE(changed([](Parts& p) { p.error_steps.resize(kMaxErrorSteps + 1, p.error_steps.back()); }));
  EXPECT_FALSE(changed([](Parts& p) { std::swap(p.error_steps.front(), p.error_steps.back()); }));
  EXPECT_FALSE(changed([](Parts& p) { p.error_steps.front() = -1; }));
  for (const float no_number : {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    EXPECT_FALSE(changed([&](Parts& p) { p.error_steps.back() = no_number; }));
  }
}

TEST_P(IntervalVolumeAssemble, RefusesAFormatThatIsNone) {
  for (const double step : {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    EXPECT_FALSE(changed([&](Parts& p) { p.description.format.step = step; }));
  }
  EXPECT_FALSE(changed([](Parts& p) { p.description.format = {SampleType::f64, 0, 0, p.description.format.last}; }));
}

TEST_P(IntervalVolumeAssemble, AnotherPartIsAnotherContent) {
  const auto hash_of = [](const IntervalVolume& volume) { return decode_ivm(encode_ivm(volume), "read")->description().content_hash; };
  const auto hash_after = [&](auto change) { return hash_of(*changed(change)); };
  const std::uint64_t hash = hash_of(made_);
  EXPECT_EQ(hash_after([](Parts& p) { p.description.name += "'"; }), hash);
  EXPECT_EQ(hash_after([](Parts& p) { p.description.labels.field = "density"; }), hash);
  EXPECT_NE(hash_after([](Parts& p) { p.surface.to_distance.back() = ErrorToDistance(std::uint8_t(p.surface.to_distance.back().code() ^ 1)); }),
            hash);
  EXPECT_NE(hash_after([](Parts& p) { p.keys.set(0, p.keys[0] == 0 ? 1 : p.keys[0] - 1); }), hash);
  EXPECT_NE(hash_after([](Parts& p) { p.steps.back() = std::uint8_t(p.steps.back() == 0 ? 1 : 0); }), hash);
  EXPECT_NE(hash_after([](Parts& p) { p.description.is_exact = false; }), hash);
  EXPECT_NE(hash_after([](Parts& p) { --p.description.format.first; }), hash);
  EXPECT_NE(hash_after([](Parts& p) { p.description.corners[3] = p.description.corners[3] == 0 ? 1 : 0; }), hash);
  EXPECT_NE(hash_after([](Parts& p) { p.description.weights.of[0][1][2] ^= 1; }), hash);
}

INSTANTIATE_TEST_SUITE_P(Fields, IntervalVolumeAssemble, ::testing::Range(0u, 2u));

TEST(ValueKeys, HoldWhatWasSetInAsFewBytesAsTheGreatestNeeds) {
  std::mt19937 random(5);
  const std::array<std::pair<ValueKey, unsigned>, 8> widths{
      {{0, 1}, {255, 1}, {256, 2}, {65535, 2}, {65536, 3}, {(1u << 24) - 1, 3}, {1u << 24, 4}, {~ValueKey(0) - 1, 4}}};
  for (const auto& [last, width] : widths) {
    ValueKeys keys(100, last);
    ASSERT_EQ(keys.width(), width);
    ASSERT_EQ(keys.bytes().size(), 100 * width);
    std::vector<ValueKey> model(100);
    for (int i = 0; i < 1000; ++i) {
      const std::size_t at = random() % 100;
      const auto key = ValueKey(random() % (std::uint64_t(last) + 1));
      keys.set(at, key), model[at] = key;
    }
    for (std::size_t i = 0; i < 100; ++i) ASSERT_EQ(keys[i], model[i]);
    EXPECT_EQ(keys.size(), 100u);
  }
}

TEST(IntervalVolume, FindsItsBoundsWhenTheyAreFirstAskedFor) {
  const IntervalVolume volume = *FieldHierarchy(testing::digits({17, 9, 12}, 3), {{0, 9}, Refine::uniform}).compact();
  const std::size_t before = volume.memory_bytes();
  std::array<const ValueBounds*, 4> found{};
  {
    std::vector<std::jthread> threads;
    threads.reserve(found.size());
    for (const ValueBounds*& bounds : found) threads.emplace_back([&volume, &bounds] { bounds = &volume.bounds(); });
  }
  EXPECT_EQ(std::set(found.begin(), found.end()).size(), 1u);
  EXPECT_EQ(volume.memory_bytes(), before + found[0]->memory_bytes());
}

}  // namespace
}  // namespace intervale
