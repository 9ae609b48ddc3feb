// The interval volume's size, tetrahedron by tetrahedron, from samples and a split set alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "common/diamond/domain.h"
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

struct NaiveSum {
  double volume = 0;      // of the interval volume, in samples cubed
  double cut_volume = 0;  // of the tetrahedra that a surface cuts
};

// Over the tetrahedra of the mesh in which exactly the diamonds that is_split names are split.
inline NaiveSum naive_sum(const Volume& v, const Range& range, const std::function<bool(Vertex)>& is_split) {
  const Domain domain(v.grid.dims);
  const int n = 1 << domain.levels();
  NaiveSum sum;
  std::function<void(const Tet&)> visit = [&](const Tet& t) {
    const auto ends = longest_edge(t);
    const int a = ends[0], b = ends[1];
    const Point c{t[a][0] + t[b][0], t[a][1] + t[b][1], t[a][2] + t[b][2]};
    const Vertex middle{c[0] / 2, c[1] / 2, c[2] / 2};
    const bool whole = c[0] % 2 == 0 && c[1] % 2 == 0 && c[2] % 2 == 0;
    if (whole && is_split(middle)) {
      for (int end : {a, b}) {
        Tet half = t;
        half[end] = point(middle);
        visit(half);
      }
      return;
    }
    std::array<Vertex, 4> p;
    std::array<double, 4> f{};
    bool below = false, inside = false, above = false;
    for (int i = 0; i < 4; ++i) {
      p[i] = domain.clamp({t[i][0], t[i][1], t[i][2]});
      f[i] = sample(v, p[i].x, p[i].y, p[i].z);
      below |= f[i] < range.alpha;
      above |= f[i] > range.beta;
      inside |= f[i] >= range.alpha && f[i] <= range.beta;
    }
    double d[3][3];
    for (int i = 0; i < 3; ++i) d[i][0] = p[i + 1].x - p[0].x, d[i][1] = p[i + 1].y - p[0].y, d[i][2] = p[i + 1].z - p[0].z;
    const double size = std::abs(d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                                 d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0])) /
                        6;
    if (below + inside + above > 1) sum.cut_volume += size;
    if (!below && !above)
      sum.volume += size;
    else
      sum.volume += size * (share_below(f, range.beta) - share_below(f, range.alpha));
  };
  for (const Tet& t : coarsest(n)) visit(t);
  return sum;
}

}  // namespace intervale::testing
