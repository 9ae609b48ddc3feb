#include "server/builder/field_hierarchy.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <span>

#include "common/ivm/ivm_file.h"
#include "common/ivm/verify.h"
#include "server/builder/error_steps.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/bisection.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using testing::bisect;
using testing::NaiveDiamond;
using testing::Tet;

// Diamonds with whole centres, found by recursive bisection, and what design.md, sections 3 to 5, says about each.
class NaiveHierarchy {
 public:
  struct Diamond {
    bool exists = false;    // has a tetrahedron that clamping does not make flat
    bool relevant = false;  // counts, or has a relevant child
    double error = 0, saturated = 0;
  };

  NaiveHierarchy(const Volume& volume, const Range& range, Refine refine)
      : volume_(volume), range_(range), refine_(refine), domain_(volume.grid.dims) {
    for (const auto& [twice, d] : bisect(domain_.levels())) {
      if (whole(twice)) known_.emplace(twice, d);
    }
    for (const auto& [twice, d] : known_) judge(twice);
  }

  [[nodiscard]] const std::map<testing::Point, Diamond>& all() const { return judged_; }  // by twice the centre

 private:
  static bool whole(const testing::Point& twice) { return twice[0] % 2 == 0 && twice[1] % 2 == 0 && twice[2] % 2 == 0; }
  [[nodiscard]] testing::Point clamp(const testing::Point& p) const { return point(domain_.clamp({p[0], p[1], p[2]})); }
  [[nodiscard]] double value(const testing::Point& p) const {
    const testing::Point c = clamp(p);
    return testing::sample(volume_, c[0], c[1], c[2]);
  }
  [[nodiscard]] std::array<Vertex, 4> clamped(const Tet& t) const {
    std::array<Vertex, 4> p;
    for (int i = 0; i < 4; ++i) p[i] = domain_.clamp({t[i][0], t[i][1], t[i][2]});
    return p;
  }

  const Diamond& judge(const testing::Point& twice) {
    if (const auto done = judged_.find(twice); done != judged_.end()) return done->second;
    const NaiveDiamond& d = known_.at(twice);
    const testing::Point centre{twice[0] / 2, twice[1] / 2, twice[2] / 2};
    Diamond result;
    std::set<Side> sides{side_of(value(centre), range_)};
    for (const Tet& t : d.tets) {
      if (!Domain::exists(clamped(t))) continue;
      result.exists = true;
      for (const testing::Point& v : t) sides.insert(side_of(value(v), range_));
      result.error = std::max(result.error, error_in(t));
    }
    // Splitting a finest diamond whose centre clamps to an end of its spine changes nothing.
    const bool finest = std::none_of(d.children.begin(), d.children.end(), whole);
    const bool idle = finest && (clamp(centre) == clamp(d.spine[0]) || clamp(centre) == clamp(d.spine[1]));
    if (result.exists && !idle) {
      result.relevant = sides.size() > 1 || (refine_ == Refine::uniform && sides.contains(Side::inside));
      result.saturated = result.error;
      for (const testing::Point& child : d.children) {
        if (!whole(child)) continue;
        const Diamond& c = judge(child);
        if (!c.relevant) continue;
        result.relevant = true;
        result.saturated = std::max(result.saturated, c.saturated);
      }
    }
    return judged_[twice] = result;
  }

  // The largest difference to linear interpolation at any sample in a clamped tetrahedron, by barycentric coordinates.
  [[nodiscard]] double error_in(const Tet& t) const {
    const auto p = clamped(t);
    const auto det = [](Vertex a, Vertex b, Vertex c, Vertex d) {
      const std::int64_t u[3] = {b.x - a.x, b.y - a.y, b.z - a.z}, v[3] = {c.x - a.x, c.y - a.y, c.z - a.z}, w[3] = {d.x - a.x, d.y - a.y, d.z - a.z};
      return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) + u[2] * (v[0] * w[1] - v[1] * w[0]);
    };
    const std::int64_t all = det(p[0], p[1], p[2], p[3]);
    double worst = 0;
    const Vertex last = domain_.last();
    for (std::int32_t z = 0; z <= last.z; ++z) {
      for (std::int32_t y = 0; y <= last.y; ++y) {
        for (std::int32_t x = 0; x <= last.x; ++x) {
          const Vertex q{x, y, z};
          const std::int64_t share[4] = {det(q, p[1], p[2], p[3]), det(p[0], q, p[2], p[3]), det(p[0], p[1], q, p[3]), det(p[0], p[1], p[2], q)};
          double interpolated = 0;
          bool in = true;
          for (int i = 0; i < 4; ++i) {
            in = in && (all > 0 ? share[i] >= 0 : share[i] <= 0);
            interpolated += double(share[i]) / double(all) * value(testing::point(p[i]));
          }
          if (in) worst = std::max(worst, std::abs(value(testing::point(q)) - interpolated));
        }
      }
    }
    return worst;
  }

  static testing::Point point(Vertex v) { return testing::point(v); }
  const Volume& volume_;
  Range range_;
  Refine refine_;
  Domain domain_;
  std::map<testing::Point, NaiveDiamond> known_;
  std::map<testing::Point, Diamond> judged_;
};

struct Trial {
  Volume volume;
  BuildOptions options;
};

Trial trial(unsigned seed) {
  std::mt19937 random(seed);
  const auto side = [&] { return std::int32_t(2 + random() % 8); };
  std::array<std::int32_t, 3> dims{side(), side(), side()};
  if (seed % 4 == 0) dims = {9, 9, 9};
  Trial t;
  switch (seed % 3) {
    case 0:
      t.volume = testing::digits(dims, seed), t.options.range = {double(random() % 7), 7.5};
      break;
    case 1:
      t.volume = testing::gyroid(dims), t.options.range = {-0.3, 0.2};
      break;
    default:
      t.volume = testing::bump(dims, seed), t.options.range = {70, 90};
  }
  if (seed % 5 == 1) t.options.range.beta = t.options.range.alpha;
  if (seed % 5 == 2) t.options.range.beta = kInf;
  if (seed % 7 == 3) t.options.range = {1000, 2000};
  if (seed % 7 == 5) t.options.range = {-kInf, kInf};
  t.options.refine = seed % 2 == 0 ? Refine::boundary : Refine::uniform;
  return t;
}

class Hierarchy : public ::testing::TestWithParam<unsigned> {};

TEST_P(Hierarchy, RelevanceAndSaturatedErrorsEqualTheirDefinitions) {
  const Trial t = trial(GetParam());
  const auto& dims = t.volume.grid.dims;
  SCOPED_TRACE(::testing::Message() << "seed " << GetParam() << ", " << dims[0] << " x " << dims[1] << " x " << dims[2]);
  const FieldHierarchy delta(t.volume, t.options);
  const NaiveHierarchy naive(t.volume, t.options.range, t.options.refine);
  std::size_t relevant = 0;
  for (const auto& [twice, expected] : naive.all()) {
    const Vertex c{twice[0] / 2, twice[1] / 2, twice[2] / 2};
    const auto place = delta.set().find(c);
    ASSERT_EQ(place.has_value(), expected.relevant) << "at (" << c.x << ", " << c.y << ", " << c.z << ")";
    if (!place) continue;
    ++relevant;
    const double error = double(delta.error(place->index)), tolerance = 1e-12 * (1 + expected.saturated);
    EXPECT_GE(error, expected.saturated - tolerance) << "rounded up";
    EXPECT_LE(error, double(std::nextafter(float(expected.saturated), std::numeric_limits<float>::infinity())) + tolerance)
        << "by no more than a step";
    EXPECT_EQ(delta.side(c), side_of(testing::sample(t.volume, std::min(c.x, dims[0] - 1), std::min(c.y, dims[1] - 1), std::min(c.z, dims[2] - 1)),
                                     t.options.range));
  }
  EXPECT_EQ(delta.set().size(), relevant);
}

TEST_P(Hierarchy, SigmaKeepsTheErrorsAtLeastAndInOrder) {
  const Trial t = trial(GetParam());
  const FieldHierarchy delta(t.volume, t.options);
  const auto sigma = delta.compact();
  ASSERT_TRUE(sigma) << sigma.error().message;
  std::set<float> distinct;
  float most = 0;
  for (UpdateIndex i{0}; i < delta.set().size(); ++i) distinct.insert(delta.error(i)), most = std::max(most, delta.error(i));
  EXPECT_EQ(sigma->description().max_error, double(most));
  for (UpdateIndex i{0}; i < delta.set().size(); ++i) {
    EXPECT_GE(sigma->error(i), delta.error(i));
    if (distinct.size() <= std::size_t(kMaxErrorSteps)) {
      EXPECT_EQ(sigma->error(i), delta.error(i));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, Hierarchy, ::testing::Range(1u, 37u));

TEST(FieldHierarchy, AnyNumberOfThreadsGivesTheSameBytes) {
  const std::array<std::int32_t, 3> dims{33, 40, 21};
  for (const Volume& volume : {testing::gyroid(dims), testing::bump(dims, 5)}) {
    const BuildOptions options{.range = volume.type == SampleType::f32 ? Range{-0.3, 0.2} : Range{30, 60}};
    std::vector<std::byte> expected;
    for (const std::size_t threads : {1, 2, 3, 8}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      const auto sigma = FieldHierarchy(volume, options).compact();
      ASSERT_TRUE(sigma);
      const auto bytes = encode_ivm(*sigma);
      if (expected.empty()) expected = bytes;
      EXPECT_TRUE(bytes == expected) << threads << " threads";
    }
  }
}

TEST(FieldHierarchy, ProgressAscendsToOne) {
  std::vector<double> told;
  const Volume volume = testing::gyroid({17, 17, 17});
  const FieldHierarchy delta(volume, {.range = {-0.3, 0.2}, .progress = [&](double share) { told.push_back(share); }});
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_GE(told.front(), 0);
  EXPECT_NEAR(told.back(), 1, 1e-9);
}

// Runs of samples that are inside, and runs that are not.
Volume bars(const std::array<std::int32_t, 3>& dims) {
  std::vector<std::uint8_t> f(std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  const std::size_t run = std::min<std::size_t>(4096, f.size() / 2);
  for (std::size_t i = 0; i < f.size(); ++i) f[i] = i / run % 2 == 0 ? 200 : std::uint8_t(i % 50);
  return testing::volume_of_type(SampleType::u8, dims, f);
}

class Extremes : public ::testing::TestWithParam<std::array<std::int32_t, 3>> {};

TEST_P(Extremes, AreBuiltInSecondsAndAreValid) {
  const Volume volume = bars(GetParam());
  const auto start = std::chrono::steady_clock::now();
  const auto sigma = FieldHierarchy(volume, {.range = {100, 250}}).compact();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_TRUE(sigma) << sigma.error().message;
  std::printf("             built in %.2f s, %zu updates\n", seconds, sigma->size());
  EXPECT_LT(seconds, 240) << "quadratic in the long side?";  // a tenth of that and less without a sanitizer
  if (volume.grid.sample_count() > 8) {
    EXPECT_GT(sigma->size(), 0u);
  }
  const auto valid = validate(*sigma);
  EXPECT_TRUE(valid) << valid.error().message;
}

constexpr std::array<std::array<std::int32_t, 3>, 4> kExtremes{{{3, 5, 70000}, {2, 2, 2}, {kMaxSide, 2, 3}, {2, 2, kMaxSide}}};
INSTANTIATE_TEST_SUITE_P(Dims, Extremes, ::testing::ValuesIn(std::span(kExtremes).first(testing::cases(kExtremes.size()))));

TEST(FieldHierarchy, ALinearFieldHasNoErrorAndAllItsUpdates) {
  for (const int n : {3, 5, 9, 17}) {
    std::vector<float> f;
    for (int z = 0; z < n; ++z) {
      for (int y = 0; y < n; ++y) {
        for (int x = 0; x < n; ++x) f.push_back(float(x + 2 * y - 4 * z));
      }
    }
    const Volume volume = testing::volume_of_type(SampleType::f32, {n, n, n}, f);
    const auto all = FieldHierarchy(volume, {.range = {-kInf, kInf}, .refine = Refine::uniform}).compact();
    ASSERT_TRUE(all);
    EXPECT_EQ(all->size(), std::uint32_t(n * n * n - 8)) << "every vertex but the corners";
    EXPECT_EQ(all->description().max_error, 0);
    EXPECT_EQ(all->error_steps().size(), 1u);
    const auto some = FieldHierarchy(volume, {.range = {-1.5, 0.5}}).compact();
    ASSERT_TRUE(some);
    EXPECT_GT(some->size(), std::uint32_t(n * n));
    EXPECT_EQ(some->description().max_error, 0);
  }
}

class ErrorSteps : public ::testing::TestWithParam<unsigned> {};

TEST_P(ErrorSteps, AscendRoundUpAndEndWithTheLargest) {
  std::mt19937 random(GetParam());
  std::vector<float> errors(1 + random() % 5000);
  const unsigned distinct = 1 + unsigned(random()) % 3000;
  for (float& e : errors) e = GetParam() % 2 == 0 ? float(random() % distinct) : std::exp(float(random() % distinct) / 100);
  std::set<float> values(errors.begin(), errors.end());
  for (const std::size_t most : {2u, 3u, 17u, 512u}) {
    SCOPED_TRACE(::testing::Message() << "seed " << GetParam() << ", at most " << most << " of " << values.size());
    const auto levels = choose_error_steps(errors, most);
    ASSERT_FALSE(levels.empty());
    EXPECT_LE(levels.size(), most);
    EXPECT_TRUE(std::is_sorted(levels.begin(), levels.end()));
    EXPECT_EQ(std::adjacent_find(levels.begin(), levels.end()), levels.end());
    EXPECT_EQ(levels.back(), *values.rbegin());
    for (float level : levels) EXPECT_TRUE(values.contains(level));
    if (values.size() <= most) {
      EXPECT_EQ(levels.size(), values.size()) << "exact when few are distinct";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Random, ErrorSteps, ::testing::Range(0u, 10u));

TEST(ErrorSteps, OfNothingAreNone) { EXPECT_TRUE(choose_error_steps({}, 512).empty()); }

}  // namespace
}  // namespace intervale
