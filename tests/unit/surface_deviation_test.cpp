#include "common/ranges/surface_deviation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/patch/range.h"
#include "common/patch/visit_samples.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/bisection.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

constexpr int kTopScale = 4;           // coarser diamonds have their width
constexpr double kLeast = 1e-4;        // of the finest diamonds' width: smaller moves are none
constexpr double kFloat = 1e-5;        // of the field's span: what rounding does to an interpolant
using Vector = std::array<double, 3>;  // in samples

// A point on an edge of the finest tetrahedra where a surface passes.
struct Crossing {
  Vector at;
  double surface;
  bool is_beta;
};

// Whether alpha, or beta, lies between two of these values.
bool lies_between(std::span<const double> values, const Range& range, bool is_beta) {
  return std::any_of(values.begin(), values.end(), [&](double v) {
    const Side first = side_of(values[0], range), side = side_of(v, range);
    return is_beta ? beta_cuts(first, side) : alpha_cuts(first, side);
  });
}

struct Case {
  std::string name;
  Volume volume;
  Range range;
};

double span(const Volume& v) {
  double low = kInf, high = -kInf;
  for (std::uint64_t i = 0; i < v.grid.sample_count(); ++i) {
    const double f = visit_samples(v, [i](auto samples) { return double(samples[i]); });
    low = std::min(low, f);
    high = std::max(high, f);
  }
  return high - low;
}

// The cells' edges, and those diagonals on which bisection, gone on with, would put its next centres.
std::vector<Crossing> crossings_of(const Volume& v, const Range& range) {
  std::vector<Crossing> all;
  const Domain domain(v.grid.dims);
  const Vertex last = domain.last();
  // The edges, each once: of all tetrahedra that the bisection of the smallest box with everything else around ends
  // with, seen from every sample.
  using testing::Point;
  std::set<std::array<Point, 2>> edges;
  for (const auto& [doubled, diamond] : testing::bisect(2)) {
    if (doubled[0] % 2 == 0 || doubled[1] % 2 == 0 || doubled[2] % 2 == 0) continue;  // only the last ones have their spines along cells' diagonals
    for (const testing::Tet& tet : diamond.tets) {
      for (int i = 0; i < 4; ++i) {
        for (int k = i + 1; k < 4; ++k) {
          if (std::max({tet[i][0], tet[i][1], tet[i][2], tet[k][0], tet[k][1], tet[k][2]}) <= 2) edges.insert({tet[i], tet[k]});
        }
      }
    }
  }
  // They repeat with every second sample.
  std::set<std::array<Point, 2>> done;
  for (int z = 0; z <= last.z; z += 2) {
    for (int y = 0; y <= last.y; y += 2) {
      for (int x = 0; x <= last.x; x += 2) {
        for (const auto& [first, second] : edges) {
          const Point p{first[0] + x, first[1] + y, first[2] + z}, q{second[0] + x, second[1] + y, second[2] + z};
          const Vertex from{p[0], p[1], p[2]}, to{q[0], q[1], q[2]};
          if (!domain.contains(from) || !domain.contains(to) || !done.insert({p, q}).second) continue;
          const double a = testing::sample(v, p[0], p[1], p[2]), b = testing::sample(v, q[0], q[1], q[2]);
          const auto add = [&](double surface, bool is_beta) {
            const double t = (surface - a) / (b - a);
            all.push_back({{p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1]), p[2] + t * (q[2] - p[2])}, surface, is_beta});
          };
          const Side side = side_of(a, range), other = side_of(b, range);
          if (alpha_cuts(side, other)) add(range.alpha, false);
          if (beta_cuts(side, other)) add(range.beta, true);
        }
      }
    }
  }
  return all;
}

// One tetrahedron of a diamond: what it says of a point.
class NaiveTet {
 public:
  NaiveTet(const Volume& volume, const Domain& domain, const Diamond& d, int tet) : most_(diamond_width(volume.grid) * d.h) {
    for (int i = 0; i < 4; ++i) {
      const Vertex v = d.vertex(d.row->tet(tet)[i]), c = domain.clamp(v);
      corner_[i] = {double(v.x), double(v.y), double(v.z)};
      value_[i] = testing::sample(volume, c.x, c.y, c.z);
      moved_ = moved_ || c != v;
    }
    det_ = det(corner_[0], corner_[1], corner_[2], corner_[3]);
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      Vector step{};
      step[std::size_t(k)] = 1;
      const double slope = (interpolant(step) - interpolant({})) / volume.grid.affine.spacing()[k];
      square += slope * slope;
    }
    slope_ = std::sqrt(square);
  }

  [[nodiscard]] bool holds(const Vector& p) const {
    for (int i = 0; i < 4; ++i) {
      if (weight(p, i) < -1e-6) return false;
    }
    return true;
  }
  // How far a point is from the interpolant's surface, if there is one and the interpolant is off by so much more.
  [[nodiscard]] double distance(const Crossing& c, double more, bool has_patch) const {
    if (moved_ || slope_ == 0 || !has_patch) return most_;
    return std::min(most_, std::max(0.0, std::abs(interpolant(c.at) - c.surface) + more) / slope_);
  }
  // Without the diamond's width as a bound, where it is not told by that alone.
  [[nodiscard]] double uncapped_distance(const Crossing& c, double more) const {
    return moved_ || slope_ == 0 ? most_ : (std::abs(interpolant(c.at) - c.surface) + more) / slope_;
  }

 private:
  static double det(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
    double m[3][3];
    for (int k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  }
  [[nodiscard]] double weight(const Vector& p, int i) const {
    auto corner = corner_;
    corner[i] = p;
    return det(corner[0], corner[1], corner[2], corner[3]) / det_;
  }
  [[nodiscard]] double interpolant(const Vector& p) const {
    double f = 0;
    for (int i = 0; i < 4; ++i) f += weight(p, i) * value_[i];
    return f;
  }
  std::array<Vector, 4> corner_;
  std::array<double, 4> value_{};
  double det_ = 0, slope_ = 0, most_;
  bool moved_ = false;
};

double value_at(const Volume& volume, const Domain& domain, Vertex v) {
  const Vertex c = domain.clamp(v);
  return testing::sample(volume, c.x, c.y, c.z);
}

// How far apart the coarse mesh and the full one cut a diamond's spine.
double tip_of(const Case& c, const Domain& domain, const Diamond& d) {
  const Vertex a = d.vertex(0), b = d.vertex(1);
  if (!domain.contains(a) || !domain.contains(b)) return 0;
  std::vector<double> values;
  for (int i = 0; i <= 2 * d.h; ++i) {
    const auto on = [&](std::int32_t from, std::int32_t to) { return from + (to - from) / (2 * d.h) * i; };
    values.push_back(value_at(c.volume, domain, {on(a.x, b.x), on(a.y, b.y), on(a.z, b.z)}));
  }
  const Vec3 spacing = c.volume.grid.affine.spacing();
  const double length = std::hypot(spacing[0] * (b.x - a.x), spacing[1] * (b.y - a.y), spacing[2] * (b.z - a.z));
  double furthest = 0;
  for (const bool is_beta : {false, true}) {
    const double surface = is_beta ? c.range.beta : c.range.alpha;
    const std::array<double, 2> ends{values.front(), values.back()};
    if (!lies_between(ends, c.range, is_beta)) continue;
    const double cut = (surface - ends[0]) / (ends[1] - ends[0]);
    double nearest = 1;
    for (int i = 0; i < 2 * d.h; ++i) {
      if (!lies_between(std::span(values).subspan(std::size_t(i), 2), c.range, is_beta)) continue;
      nearest = std::min(nearest, std::abs((i + (surface - values[i]) / (values[i + 1] - values[i])) / (2 * d.h) - cut));
    }
    furthest = std::max(furthest, nearest * length);
  }
  return furthest;
}

Case case_of_seed(unsigned seed) {
  Case c;
  switch (seed % 8) {
    case 0:
      c = {"gyroid", testing::gyroid({9, 9, 9}), {-0.3, 0.2}};
      break;
    case 1:
      c = {"digits, surfaces at samples", testing::digits({12, 5, 7}, seed), {3, 5}};
      break;
    case 2:
      c = {"bump", testing::bump({9, 9, 9}, seed), {70, kInf}};
      break;
    case 3:
      c = {"digits", testing::digits({9, 9, 9}, seed), {3.5, 6.25}};
      break;
    case 4:
      c = {"gyroid, both surfaces one", testing::gyroid({12, 5, 7}), {0.1, 0.1}};
      break;
    case 5:
      c = {"digits, both surfaces one, at samples", testing::digits({7, 9, 4}, seed), {4, 4}};
      break;
    case 6:
      c = {"gyroid, wider than the cubes that are gone through", testing::gyroid({40, 3, 4}), {-kInf, 0.2}};
      break;
    default:
      c = {"bump, a box that does not nest", testing::bump({10, 16, 3}, seed), {60, 80}};
  }
  if (seed % 2 == 1 || seed >= 8) c.volume.grid.affine = Affine::of({0.5, 1, 3});
  c.name += ", seed " + std::to_string(seed);
  return c;
}

class Moves : public ::testing::TestWithParam<unsigned> {};

TEST_P(Moves, AreThoseOfTheFurthestCrossing) {
  const Case c = case_of_seed(GetParam());
  SCOPED_TRACE(c.name);
  const FieldHierarchy delta(c.volume, {.range = c.range});
  const SupercubeSet& set = delta.set();
  const Domain& domain = delta.domain();
  const std::vector<float> moves = surface_deviation(c.volume, c.range, domain, set).largest;
  ASSERT_EQ(moves.size(), set.size());
  const std::vector<Crossing> crossings = crossings_of(c.volume, c.range);
  ASSERT_FALSE(crossings.empty());
  const double width = diamond_width(c.volume.grid), rounding = kFloat * span(c.volume);
  const double furthest = 4 * width * (1 << std::min(kTopScale, domain.levels() - 1));
  std::size_t told = 0;
  for (int scale = 0; scale < domain.levels(); ++scale) {
    for (int cls = 0; cls < 3; ++cls) {
      // Faces between tetrahedra belong to any of those that share them: a crossing is told of if one of them is.
      std::vector<bool> is_there(crossings.size()), is_told(crossings.size());
      set.for_each(scale, cls, [&](const Place& p) {
        const Diamond d(SupercubeSet::centre(p));
        const double move = moves[p.index];
        if (scale > kTopScale) {
          EXPECT_NEAR(move, width * d.h, 1e-6 * width * d.h);
          return;
        }
        const double tip = tip_of(c, domain, d);
        EXPECT_GE(move, tip * (1 - 1e-5) - kLeast * width * 1.001);
        double most = tip;
        bool is_lost = false;  // some crossing has no patch to be near to
        std::vector<double> values;
        values.reserve(std::size_t(d.row->vertices));
        for (int i = 0; i < d.row->vertices; ++i) values.push_back(value_at(c.volume, domain, d.vertex(i)));
        const std::array<bool, 2> has_patch{lies_between(values, c.range, false), lies_between(values, c.range, true)};
        for (int t = 0; t < d.row->tets; ++t) {
          if ((domain.tets(d) >> t & 1) == 0) continue;
          const NaiveTet tet(c.volume, domain, d, t);
          for (std::size_t i = 0; i < crossings.size(); ++i) {
            const Vector& at = crossings[i].at;
            if (std::abs(at[0] - d.centre.x) > d.h + 1e-6 || std::abs(at[1] - d.centre.y) > d.h + 1e-6 || std::abs(at[2] - d.centre.z) > d.h + 1e-6)
              continue;
            if (!tet.holds(at)) continue;
            is_there[i] = true;
            const bool patch = has_patch[crossings[i].is_beta];
            is_lost = is_lost || !patch;
            most = std::max(most, tet.distance(crossings[i], rounding, patch));
            if (move >= tet.distance(crossings[i], -rounding, patch) * (1 - 1e-5) - kLeast * width * 1.001) is_told[i] = true;
          }
        }
        if (is_lost && move > width * d.h) most = std::max(most, furthest);
        EXPECT_LE(move, most * (1 + 1e-5) + 1e-5 * width) << "scale " << scale << ", class " << cls << ": further than any crossing";
        told += move > 0;
      });
      for (std::size_t i = 0; i < crossings.size(); ++i) {
        const Vector& at = crossings[i].at;
        EXPECT_TRUE(is_told[i] || !is_there[i]) << "scale " << scale << ", class " << cls << ": the crossing at " << at[0] << ", " << at[1] << ", "
                                                << at[2] << " moves further";
      }
    }
  }
  EXPECT_GT(told, 0u);
}

// The points of all halves are those of the whole: what all diamonds remove together is the squared deviation of the
// coarsest tetrahedra that are measured. A point in a face belongs to any of those that share it, and one in a face of these
// diamonds may count for each.
TEST_P(Moves, RemoveTogetherTheSquaredDeviationOfTheCoarsestTetrahedra) {
  const Case c = case_of_seed(GetParam());
  SCOPED_TRACE(c.name);
  const FieldHierarchy delta(c.volume, {.range = c.range});
  const Domain& domain = delta.domain();
  const SurfaceDeviation found = surface_deviation(c.volume, c.range, domain, delta.set());
  EXPECT_EQ(found.top_scale, std::min(kTopScale, domain.levels() - 1));
  const double width = diamond_width(c.volume.grid) * double(1 << found.top_scale);
  const double rounding = kFloat * span(c.volume);
  double least = 0, most = 0;
  for (const Crossing& crossing : crossings_of(c.volume, c.range)) {
    double nearest = kInf;
    delta.set().for_each(found.top_scale, 0, [&](const Place& p) {
      const Diamond d(SupercubeSet::centre(p));
      std::vector<double> values;
      values.reserve(std::size_t(d.row->vertices));
      for (int i = 0; i < d.row->vertices; ++i) values.push_back(value_at(c.volume, domain, d.vertex(i)));
      const bool has_patch = lies_between(values, c.range, crossing.is_beta);
      double furthest = 0;
      for (int t = 0; t < d.row->tets; ++t) {
        if ((domain.tets(d) >> t & 1) == 0) continue;
        const NaiveTet tet(c.volume, domain, d, t);
        if (!tet.holds(crossing.at)) continue;
        nearest = std::min(nearest, tet.distance(crossing, -rounding, has_patch));
        furthest = std::max(furthest, has_patch ? tet.uncapped_distance(crossing, rounding) : 4 * width);
      }
      most += furthest * furthest;
    });
    if (nearest < kInf) least += nearest * nearest;
  }
  const Vec3 spacing = c.volume.grid.affine.spacing();
  const double shortest = std::min({spacing[0], spacing[1], spacing[2]});
  double sum = 0;
  delta.set().for_each_down([&](const Place& p) {
    sum += found.removed[p.index];
    if (scale_of_key(p.key) > found.top_scale) {
      EXPECT_EQ(found.removed[p.index], 0);
    }
  });
  EXPECT_GT(sum, 0);
  EXPECT_GE(sum * shortest * shortest, least * (1 - 1e-4));
  EXPECT_LE(sum * shortest * shortest, most * (1 + 1e-4));
}

INSTANTIATE_TEST_SUITE_P(Fields, Moves, ::testing::Range(0u, 16u));

// What lies between the same two values of samples deviates most near one of them: points move straight along their
// edges. But a tip may have a crossing near it at either value, and none in between; and rounding decides which of the
// tetrahedra on both sides of a face has a point in it, as most are in the finest ones.
TEST(SurfaceDeviation, IsMostlyLargestNearOneOfTheTwoValuesBetweenWhichASurfaceLies) {
  constexpr double kNearly = 1.0 / 64;
  std::mt19937 random(7);
  std::size_t all = 0, more = 0;
  for (unsigned seed = 0; seed < 32; ++seed) {
    Case c{"", testing::digits({9, 8, 9}, seed), {}};
    const double key = 1 + double(random() % 9), within = key - 0.02 - 0.001 * double(random() % 960);
    c.range = {within, kInf};
    const FieldHierarchy delta(c.volume, {.range = c.range});
    const std::vector<float> both = surface_deviation(c.volume, {key - kNearly, key - 1 + kNearly}, delta.domain(), delta.set()).largest;
    const std::vector<float> one = surface_deviation(c.volume, c.range, delta.domain(), delta.set()).largest;
    const double least = 2 * kLeast * diamond_width(c.volume.grid);
    delta.set().for_each_down([&](const Place& p) {
      const double tip = tip_of(c, delta.domain(), Diamond(SupercubeSet::centre(p)));
      ++all;
      more += one[p.index] > std::max(double(both[p.index]), tip) * (1 + 1e-4) + least;
    });
  }
  EXPECT_LE(more, all / 20) << "of " << all;
}

// Some samples stand out alone, away from a wall.
TEST(SurfaceDeviation, SpecksThatLieApartMoveAsFarAsToTheNextSurface) {
  const Volume volume = testing::specks({33, 33, 33}, 1);
  const FieldHierarchy delta(volume, {.range = {5, kInf}});
  const std::vector<float> moves = surface_deviation(volume, {5, kInf}, delta.domain(), delta.set()).largest;
  std::size_t far = 0;
  delta.set().for_each_down([&](const Place& p) {
    const Diamond d(SupercubeSet::centre(p));
    if (d.scale >= 3 || d.centre.z - d.h <= 16) return;  // the wall is further than these are wide
    std::array<double, kMaxVertices + 1> values{};
    for (int i = 0; i <= d.row->vertices; ++i) {
      const Vertex v = i < d.row->vertices ? d.vertex(i) : d.centre;
      values[i] = delta.domain().contains(v) ? testing::sample(volume, v.x, v.y, v.z) : 0;
    }
    const bool has_patch = std::any_of(values.begin(), values.begin() + d.row->vertices, [](double v) { return v >= 5; });
    if (has_patch || moves[p.index] == 0) return;
    EXPECT_GE(moves[p.index], 16);
    ++far;
  });
  EXPECT_GT(far, 10u);
}

// Labels: a surface that passes exactly at samples, with nothing on its other side.
TEST(SurfaceDeviation, ASurfaceAtTheLeastOrTheLargestSamplesMoves) {
  std::vector<std::uint8_t> labels(9 * 9 * 9);
  for (int i = 0; i < 9 * 9 * 9; ++i)
    labels[std::size_t(i)] = (i % 9 - 4) * (i % 9 - 4) + (i / 9 % 9 - 3) * (i / 9 % 9 - 3) + (i / 81 - 4) * (i / 81 - 4) < 9;
  const Volume volume = testing::volume_of_type(SampleType::u8, {9, 9, 9}, labels);
  for (const Range range : {Range{1, kInf}, Range{1, 1}, Range{-kInf, 0}, Range{0, 0}}) {
    const FieldHierarchy delta(volume, {.range = range});
    const std::vector<float> moves = surface_deviation(volume, range, delta.domain(), delta.set()).largest;
    ASSERT_GT(moves.size(), 0u);
    EXPECT_GT(std::count_if(moves.begin(), moves.end(), [](float m) { return m > 0; }), 100) << "[" << range.alpha << ", " << range.beta << "]";
  }
}

// What is far from 0 is as good as what is not.
TEST(SurfaceDeviation, DoNotDependOnTheFieldsZero) {
  const Volume volume = testing::gyroid({17, 17, 17});
  std::vector<double> near, far;
  for (std::uint64_t i = 0; i < volume.grid.sample_count(); ++i) {
    const double f = std::round(visit_samples(volume, [i](auto samples) { return double(samples[i]); }) * 1024) / 1024;
    near.push_back(f);
    far.push_back(f + 1e9);
  }
  const auto moves_of = [&](const std::vector<double>& samples, const Range& range) {
    const Volume v = testing::volume_of_type(SampleType::f64, volume.grid.dims, samples);
    const FieldHierarchy delta(v, {.range = range});
    return surface_deviation(v, range, delta.domain(), delta.set()).largest;
  };
  const auto expected = moves_of(near, {-0.25, 0.25}), got = moves_of(far, {1e9 - 0.25, 1e9 + 0.25});
  ASSERT_EQ(got.size(), expected.size());
  double worst = 0;
  for (std::size_t i = 0; i < got.size(); ++i) worst = std::max(worst, double(std::abs(got[i] - expected[i])));
  EXPECT_LT(worst, 1e-2);
}

}  // namespace
}  // namespace intervale
