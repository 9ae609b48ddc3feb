// Invariants of every mesh, checked in the simplest way, however slow.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/diamond/grid.h"
#include "common/mesh/mesh.h"

namespace intervale::testing {

// The first invariant that a mesh breaks, or an empty text: every point is used and unique, tetrahedra are positive (or
// flat where flat_may_be), every face is in one or two tetrahedra, and one that is in one lies on alpha, on beta or on
// a side of the sampled box: anything else is a crack.
inline std::string broken_law(const Mesh& mesh, const Grid& grid, bool flat_may_be = false) {
  std::set<std::array<double, 4>> places;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const auto& p = mesh.points[i];
    if (!places.insert({p[0], p[1], p[2], flat_may_be ? double(mesh.surface[i]) : 0}).second) return "a point is there twice";
  }
  std::vector<bool> used(mesh.points.size());
  std::map<std::array<std::uint32_t, 3>, int> faces;
  for (const auto& t : mesh.tets) {
    std::array<std::array<double, 3>, 3> d{};
    for (int i = 0; i < 4; ++i) {
      used[t[i]] = true;
      for (int k = 0; k < 3 && i > 0; ++k) d[i - 1][k] = mesh.points[t[i]][k] - mesh.points[t[0]][k];
    }
    const double det = d[0][0] * (d[1][1] * d[2][2] - d[1][2] * d[2][1]) - d[0][1] * (d[1][0] * d[2][2] - d[1][2] * d[2][0]) +
                       d[0][2] * (d[1][0] * d[2][1] - d[1][1] * d[2][0]);
    if (flat_may_be ? det < 0 : det <= 0) return "a tetrahedron is flat or turned inside out: " + std::to_string(det);
    for (int skip = 0; skip < 4; ++skip) {
      std::array<std::uint32_t, 3> f{};
      for (int i = 0, n = 0; i < 4; ++i) {
        if (i != skip) f[n++] = t[i];
      }
      std::sort(f.begin(), f.end());
      ++faces[f];
    }
  }
  for (bool u : used) {
    if (!u) return "a point is used by no tetrahedron";
  }
  for (const auto& [f, n] : faces) {
    if (n > 2) return "a face is in more than two tetrahedra";
    if (n == 2) continue;
    const auto all_on = [&, &f = f](Surface s) { return mesh.surface[f[0]] == s && mesh.surface[f[1]] == s && mesh.surface[f[2]] == s; };
    bool outside = all_on(Surface::alpha) || all_on(Surface::beta);
    for (int k = 0; k < 3; ++k) {
      for (double side : {grid.affine.origin()[k], grid.affine.origin()[k] + grid.affine.spacing()[k] * (grid.dims[k] - 1)}) {
        outside = outside || (mesh.points[f[0]][k] == side && mesh.points[f[1]][k] == side && mesh.points[f[2]][k] == side);
      }
    }
    if (!outside) return "a crack: a face with nothing behind it";
  }
  return {};
}

// A mesh without its numbers: equal for equal meshes in any order of points and tetrahedra.
using Canonical = std::set<std::array<std::array<double, 4>, 4>>;
inline Canonical canonical(const Mesh& mesh) {
  Canonical tets;
  for (const auto& t : mesh.tets) {
    std::array<std::array<double, 4>, 4> c{};
    for (int i = 0; i < 4; ++i) {
      const auto& p = mesh.points[t[i]];
      c[i] = {p[0], p[1], p[2], double(mesh.surface[t[i]])};
    }
    std::sort(c.begin(), c.end());
    tets.insert(c);
  }
  return tets;
}

}  // namespace intervale::testing
