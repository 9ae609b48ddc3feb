// Longest-edge bisection, the naive way: tetrahedra one by one, split at the middle of their longest edge. What the
// table of diamonds must agree with.
#pragma once

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <vector>

#include "common/diamond/diamond.h"

namespace intervale::testing {

using Point = std::array<int, 3>;
using Tet = std::array<Point, 4>;  // sorted

struct NaiveDiamond {
  std::set<Tet> tets;
  std::array<Point, 2> spine{};
  std::set<Point> parents, children;
};

inline Point point(Vertex v) { return {v.x, v.y, v.z}; }
inline Tet sorted(Tet t) {
  std::sort(t.begin(), t.end());
  return t;
}

// The two corners, by number, that a tetrahedron's longest edge joins.
inline std::array<int, 2> longest_edge(const Tet& t) {
  int best = -1;
  std::array<int, 2> ends{};
  for (int a = 0; a < 4; ++a) {
    for (int b = a + 1; b < 4; ++b) {
      int d = 0;
      for (int k = 0; k < 3; ++k) d += (t[a][k] - t[b][k]) * (t[a][k] - t[b][k]);
      if (d > best) best = d, ends = {a, b};
    }
  }
  return ends;
}

// The six tetrahedra around the diagonal from (0, 0, 0) to (n, n, n).
inline std::vector<Tet> coarsest(int n) {
  std::vector<Tet> tets;
  std::array<int, 3> axes{0, 1, 2};
  do {
    Tet t{};
    for (int i = 1; i < 4; ++i) {
      t[i] = t[i - 1];
      t[i][axes[i - 1]] = n;
    }
    tets.push_back(sorted(t));
  } while (std::next_permutation(axes.begin(), axes.end()));
  return tets;
}

// All diamonds of the grid of (2^levels + 1)^3 vertices, by twice their centres: those with whole centres, and the
// leaves' with half ones.
inline std::map<Point, NaiveDiamond> bisect(int levels) {
  std::map<Point, NaiveDiamond> all;
  const int n = 1 << levels;
  std::vector<Tet> open = coarsest(n);
  const auto doubled_centre = [&](const Tet& t) {
    const auto [a, b] = longest_edge(t);
    return Point{t[a][0] + t[b][0], t[a][1] + t[b][1], t[a][2] + t[b][2]};
  };
  while (!open.empty()) {
    const Tet t = open.back();
    open.pop_back();
    const auto [a, b] = longest_edge(t);
    const Point c = doubled_centre(t);
    NaiveDiamond& d = all[c];
    d.spine = {t[a], t[b]};
    if (!d.tets.insert(t).second) continue;
    if (c[0] % 2 != 0 || c[1] % 2 != 0 || c[2] % 2 != 0) continue;
    const Point middle{c[0] / 2, c[1] / 2, c[2] / 2};
    for (int end : {a, b}) {
      Tet half = t;
      half[end] = middle;
      half = sorted(half);
      const Point child = doubled_centre(half);
      all[c].children.insert(child);
      all[child].parents.insert(c);
      open.push_back(half);
    }
  }
  return all;
}

}  // namespace intervale::testing
