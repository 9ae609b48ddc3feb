// Where surfaces cross the finest tetrahedra, and what a coarse tetrahedron says of such a point: the naive way.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ivm/relevant_updates.h"
#include "common/patch/range.h"
#include "common/patch/visit_samples.h"
#include "common/util/vec3.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/bisection.h"
#include "tests/support/special_values.h"

namespace intervale::testing {

inline constexpr double kLeastMove = 1e-4;  // of the finest diamonds' width: smaller moves are none

// A point on an edge of the finest tetrahedra where a surface passes.
struct NaiveCrossing {
  Vec3 at;
  double surface;
  bool is_beta;
};

// Whether alpha, or beta, lies between two of these values.
inline bool lies_between(std::span<const double> values, const Range& range, bool is_beta) {
  return std::any_of(values.begin(), values.end(), [&](double v) {
    const Side first = side_of(values[0], range), side = side_of(v, range);
    return is_beta ? beta_cuts(first, side) : alpha_cuts(first, side);
  });
}

struct SurfaceCase {
  std::string name;
  Volume volume;
  Range range;
};

inline double field_span(const Volume& v) {
  double low = kInf, high = -kInf;
  for (std::uint64_t i = 0; i < v.grid.sample_count(); ++i) {
    const double f = visit_samples(v, [i](auto samples) { return double(samples[i]); });
    low = std::min(low, f);
    high = std::max(high, f);
  }
  return high - low;
}

// The cells' edges, and those diagonals on which bisection, gone on with, would put its next centres.
inline std::vector<NaiveCrossing> crossings_of(const Volume& v, const Range& range) {
  std::vector<NaiveCrossing> all;
  const Domain domain(v.grid.dims);
  const Vertex last = domain.last();
  // The edges, each once: of all tetrahedra that the bisection of the smallest box with everything else around ends
  // with, seen from every sample.
  std::set<std::array<Point, 2>> edges;
  for (const auto& [doubled, diamond] : bisect(2)) {
    if (doubled[0] % 2 == 0 || doubled[1] % 2 == 0 || doubled[2] % 2 == 0) continue;  // only the last ones have their spines along cells' diagonals
    for (const Tet& tet : diamond.tets) {
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
          const double a = sample(v, p[0], p[1], p[2]), b = sample(v, q[0], q[1], q[2]);
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

// One tetrahedron of a diamond: what it says of a point in sample coordinates.
class NaivePatch {
 public:
  NaivePatch(const Volume& volume, const Domain& domain, const Diamond& d, int tet) : most_(diamond_width(volume.grid) * d.h) {
    for (int i = 0; i < 4; ++i) {
      const Vertex v = d.vertex(d.row->tet(tet)[i]), c = domain.clamp(v);
      corner_[i] = {double(v.x), double(v.y), double(v.z)};
      value_[i] = sample(volume, c.x, c.y, c.z);
      moved_ = moved_ || c != v;
    }
    det_ = det(corner_[0], corner_[1], corner_[2], corner_[3]);
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      Vec3 step{};
      step[std::size_t(k)] = 1;
      const double slope = (interpolant(step) - interpolant({})) / volume.grid.affine.spacing()[k];
      square += slope * slope;
    }
    slope_ = std::sqrt(square);
  }

  [[nodiscard]] bool holds(const Vec3& p) const {
    for (int i = 0; i < 4; ++i) {
      if (weight(p, i) < -1e-6) return false;
    }
    return true;
  }
  // How far a point is from the interpolant's surface, if there is one and the interpolant is off by so much more.
  [[nodiscard]] double distance(const NaiveCrossing& c, double more, bool has_patch) const {
    if (moved_ || slope_ == 0 || !has_patch) return most_;
    return std::min(most_, std::max(0.0, std::abs(interpolant(c.at) - c.surface) + more) / slope_);
  }
  // Without the diamond's width as a bound, where it is not told by that alone.
  [[nodiscard]] double uncapped_distance(const NaiveCrossing& c, double more) const {
    return moved_ || slope_ == 0 ? most_ : (std::abs(interpolant(c.at) - c.surface) + more) / slope_;
  }

 private:
  static double det(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
    double m[3][3];
    for (int k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  }
  [[nodiscard]] double weight(const Vec3& p, int i) const {
    auto corner = corner_;
    corner[i] = p;
    return det(corner[0], corner[1], corner[2], corner[3]) / det_;
  }
  [[nodiscard]] double interpolant(const Vec3& p) const {
    double f = 0;
    for (int i = 0; i < 4; ++i) f += weight(p, i) * value_[i];
    return f;
  }
  std::array<Vec3, 4> corner_;
  std::array<double, 4> value_{};
  double det_ = 0, slope_ = 0, most_;
  bool moved_ = false;
};

inline double value_at(const Volume& volume, const Domain& domain, Vertex v) {
  const Vertex c = domain.clamp(v);
  return sample(volume, c.x, c.y, c.z);
}

// How far apart the coarse mesh and the full one cut a diamond's spine.
inline double tip_of(const SurfaceCase& c, const Domain& domain, const Diamond& d) {
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

inline SurfaceCase case_of_seed(unsigned seed) {
  SurfaceCase c;
  switch (seed % 8) {
    case 0:
      c = {"gyroid", gyroid({9, 9, 9}), {-0.3, 0.2}};
      break;
    case 1:
      c = {"digits, surfaces at samples", digits({12, 5, 7}, seed), {3, 5}};
      break;
    case 2:
      c = {"bump", bump({9, 9, 9}, seed), {70, kInf}};
      break;
    case 3:
      c = {"digits", digits({9, 9, 9}, seed), {3.5, 6.25}};
      break;
    case 4:
      c = {"gyroid, both surfaces one", gyroid({12, 5, 7}), {0.1, 0.1}};
      break;
    case 5:
      c = {"digits, both surfaces one, at samples", digits({7, 9, 4}, seed), {4, 4}};
      break;
    case 6:
      c = {"gyroid, wider than the cubes that are gone through", gyroid({40, 3, 4}), {-kInf, 0.2}};
      break;
    default:
      c = {"bump, a box that does not nest", bump({10, 16, 3}, seed), {60, 80}};
  }
  if (seed % 2 == 1 || seed >= 8) c.volume.grid.affine = Affine::of({0.5, 1, 3});
  c.name += ", seed " + std::to_string(seed);
  return c;
}

}  // namespace intervale::testing
