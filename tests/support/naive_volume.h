// The interval volume's size and the points of its mesh, tetrahedron by tetrahedron, from samples and a split set
// alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/diamond/domain.h"
#include "common/mesh/mesh.h"
#include "common/patch/range.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/bisection.h"

namespace intervale::testing {

// The share of a tetrahedron where a linear function with these values at its corners is less than kappa.
inline double share_below(std::array<double, 4> f, double kappa) {
  std::sort(f.begin(), f.end());
  if (kappa <= f[0]) return 0;
  if (kappa >= f[3]) return 1;
  const auto r = [&](int i, int j) { return (kappa - f[i]) / (f[j] - f[i]); };  // how far along edge i-j
  if (kappa <= f[1]) return r(0, 1) * r(0, 2) * r(0, 3);
  if (kappa >= f[2]) return 1 - r(3, 0) * r(3, 1) * r(3, 2);
  return r(0, 2) * r(0, 3) * (1 - r(1, 2)) + r(0, 3) * r(1, 2) * (1 - r(1, 3)) + r(1, 2) * r(1, 3);
}

// A tetrahedron that is not flat.
struct NaiveTet {
  std::array<Vertex, 4> position;  // in samples
  std::array<double, 4> value{};
  double size = 0;  // in samples cubed
};

// Calls visit(tet) for the tetrahedra of the field's mesh in which exactly the diamonds that is_split names are split.
template <class Visit>
void for_each_naive_tet(const Volume& v, const std::function<bool(Vertex)>& is_split, const Visit& visit) {
  const Domain domain(v.grid.dims);
  const std::function<void(const Tet&)> descend = [&](const Tet& t) {
    const auto ends = longest_edge(t);
    const int a = ends[0], b = ends[1];
    const Point c{t[a][0] + t[b][0], t[a][1] + t[b][1], t[a][2] + t[b][2]};
    const Vertex middle{c[0] / 2, c[1] / 2, c[2] / 2};
    const bool whole = c[0] % 2 == 0 && c[1] % 2 == 0 && c[2] % 2 == 0;
    if (whole && is_split(middle)) {
      for (int end : {a, b}) {
        Tet half = t;
        half[end] = point(middle);
        descend(half);
      }
      return;
    }
    NaiveTet tet;
    for (int i = 0; i < 4; ++i) {
      const Vertex p = tet.position[i] = domain.clamp({t[i][0], t[i][1], t[i][2]});
      tet.value[i] = sample(v, p.x, p.y, p.z);
    }
    const auto& p = tet.position;
    double d[3][3];
    for (int i = 0; i < 3; ++i) d[i][0] = p[i + 1].x - p[0].x, d[i][1] = p[i + 1].y - p[0].y, d[i][2] = p[i + 1].z - p[0].z;
    tet.size = std::abs(d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                        d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0])) /
               6;
    if (tet.size > 0) visit(tet);
  };
  for (const Tet& t : coarsest(1 << domain.levels())) descend(t);
}

struct NaiveSum {
  double volume = 0;      // of the interval volume, in samples cubed
  double cut_volume = 0;  // of the tetrahedra that a surface cuts
};

inline NaiveSum naive_sum(const Volume& v, const Range& range, const std::function<bool(Vertex)>& is_split) {
  NaiveSum sum;
  for_each_naive_tet(v, is_split, [&](const NaiveTet& tet) {
    bool below = false, inside = false, above = false;
    for (const double f : tet.value) {
      below |= f < range.alpha;
      above |= f > range.beta;
      inside |= f >= range.alpha && f <= range.beta;
    }
    if (below + inside + above > 1) sum.cut_volume += tet.size;
    if (!below && !above)
      sum.volume += tet.size;
    else
      sum.volume += tet.size * (share_below(tet.value, range.beta) - share_below(tet.value, range.alpha));
  });
  return sum;
}

// Points of a mesh, ascending: their places in 1/512 of a sample, where every cut is a whole number; and what they lie
// on.
using PlacedPoints = std::vector<std::array<std::int64_t, 4>>;

inline PlacedPoints points_of(const Mesh& mesh, const Grid& grid) {
  PlacedPoints points(mesh.points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) points[i][k] = std::llround((mesh.points[i][k] - grid.affine.origin()[k]) / grid.affine.spacing()[k] * 512);
    points[i][3] = std::int64_t(mesh.surface[i]);
  }
  std::sort(points.begin(), points.end());
  return points;
}

// The points that a mesh has by the samples: vertices inside the range, and the cuts on the edges of tetrahedra.
inline PlacedPoints naive_points(const Volume& v, const Range& range, const std::function<bool(Vertex)>& is_split) {
  PlacedPoints points;
  for_each_naive_tet(v, is_split, [&](const NaiveTet& tet) {
    const auto add = [&](const Vertex& a, const Vertex& b, std::int64_t t, Surface surface) {
      points.push_back({512 * a.x + (b.x - a.x) * t, 512 * a.y + (b.y - a.y) * t, 512 * a.z + (b.z - a.z) * t, std::int64_t(surface)});
    };
    for (std::size_t i = 0; i < 4; ++i) {
      const Vertex& a = tet.position[i];
      const Side side = side_of(tet.value[i], range);
      if (side == Side::inside) add(a, a, 0, Surface::inside);
      for (std::size_t k = i + 1; k < 4; ++k) {
        const Side other = side_of(tet.value[k], range);
        const Cuts cuts = cuts_between(tet.value[i], tet.value[k], range);
        int n = 0;
        if (alpha_cuts(side, other)) add(a, tet.position[k], 2 * cuts.q[n++] + 1, Surface::alpha);
        if (beta_cuts(side, other)) add(a, tet.position[k], 2 * cuts.q[n++] + 1, Surface::beta);
      }
    }
  });
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

}  // namespace intervale::testing
