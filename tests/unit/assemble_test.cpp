// Interval volumes put together of parts that fit, and of parts that do not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <utility>

#include "common/ivm/interval_volume.h"
#include "common/ivm/verify.h"
#include "tests/support/equal_volumes.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parts.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using Parts = IntervalVolume::Parts;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Assemble : public ::testing::Test {
 protected:
  const IntervalVolume sigma_ = testing::build(testing::gyroid({9, 7, 6}), {.range = {-0.3, 0.4}});
};

TEST_F(Assemble, PartsThatFitMakeAnEqualVolume) {
  const auto again = IntervalVolume::assemble(testing::parts_of(sigma_));
  ASSERT_TRUE(again) << again.error().message;
  testing::expect_equal(sigma_, *again);
}

TEST_F(Assemble, PartsThatDoNotFitAreRefused) {
  ASSERT_GT(sigma_.error_steps().size(), 3u);
  const struct {
    const char* what;
    void (*spoil)(Parts&);
  } cases[] = {
      {"too few steps", [](Parts& p) { p.steps.pop_back(); }},
      {"too few error_to_distance codes", [](Parts& p) { p.surface.to_distance.pop_back(); }},
      {"too few slopes", [](Parts& p) { p.surface.slopes.pop_back(); }},
      {"too few distances", [](Parts& p) { p.surface.distances.resize(p.set.size() - 1); }},
      {"a slope out of range", [](Parts& p) { p.surface.slopes.back() = kMaxSlope + 1; }},
      {"too many steps", [](Parts& p) { p.steps.push_back(0); }},
      {"no steps", [](Parts& p) { p.steps.clear(); }},
      {"no values", [](Parts& p) { p.keys = {}; }},
      {"a value too many", [](Parts& p) { p.keys = ValueKeys(p.keys.size() + 1, p.description.format.last); }},
      {"a value out of range",
       [](Parts& p) {
         p.keys.set(0, p.description.format.last);
         --p.description.format.last;
         p.description.corners = {};
       }},
      {"no set", [](Parts& p) { p.set = SupercubeSet(); }},
      {"an error that is not there", [](Parts& p) { p.steps[0] = std::uint8_t(p.error_steps.size()); }},
      {"errors that descend", [](Parts& p) { std::swap(p.error_steps[0], p.error_steps[1]); }},
      {"a negative error", [](Parts& p) { p.error_steps[0] = -1; }},
      {"an infinite error", [](Parts& p) { p.error_steps.back() = std::numeric_limits<float>::infinity(); }},
      {"an error that is no number", [](Parts& p) { p.error_steps[1] = std::numeric_limits<float>::quiet_NaN(); }},
      {"no errors", [](Parts& p) { p.error_steps.clear(); }},
      {"too many errors", [](Parts& p) { p.error_steps.resize(kMaxErrorSteps + 1, p.error_steps.back()); }},
      {"a corner out of range", [](Parts& p) { p.description.corners[7] = p.description.format.last + 1; }},
      {"a negative step", [](Parts& p) { p.description.format.step = -1; }},
      {"a negative largest error", [](Parts& p) { p.description.max_error = -1; }},
      {"a side of 1 sample", [](Parts& p) { p.description.grid.dims[1] = 1; }},
      {"a negative side", [](Parts& p) { p.description.grid.dims[2] = -9; }},
      {"a side that is too long", [](Parts& p) { p.description.grid.dims[0] = kMaxSide + 1; }},
      {"no spacing", [](Parts& p) { p.description.grid.affine.rows[0] = 0; }},
      {"infinite spacing", [](Parts& p) { p.description.grid.affine.rows[0] = kInf; }},
      {"an origin that is no number", [](Parts& p) { p.description.grid.affine.rows[11] = std::numeric_limits<double>::quiet_NaN(); }},
      {"a range upside down",
       [](Parts& p) {
         p.description.range = {1, 0};
       }},
      {"a range that is no number", [](Parts& p) { p.description.range.beta = std::numeric_limits<double>::quiet_NaN(); }},
  };
  for (const auto& c : cases) {
    Parts parts = testing::parts_of(sigma_);
    c.spoil(parts);
    const auto assembled = IntervalVolume::assemble(std::move(parts));
    ASSERT_FALSE(assembled) << c.what;
    EXPECT_THAT(assembled.error().message, AllOf(Not(IsEmpty()), Not(HasSubstr("\n")))) << c.what;
  }
}

// What assemble() cannot see, validate() does.
TEST_F(Assemble, PartsThatFitButMeanNothingAreNotValid) {
  const auto refused = [&](auto spoil) {
    auto parts = testing::parts_of(sigma_);
    spoil(parts);
    const auto assembled = IntervalVolume::assemble(std::move(parts));
    return !assembled || !validate(*assembled);
  };
  EXPECT_FALSE(refused([](auto&) {}));
  EXPECT_TRUE(refused([](auto& p) { ++p.description.full.tets; }));
  EXPECT_TRUE(refused([](auto& p) { --p.description.full.vertices; }));
  EXPECT_TRUE(refused([](auto& p) { p.description.grid.dims = {3, 2, 2}; })) << "updates outside the box";
  EXPECT_TRUE(refused([](auto& p) { p.steps[0] = 0; })) << "the root's error is its descendants' least";
}

}  // namespace
}  // namespace intervale
