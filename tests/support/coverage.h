// Which samples a mesh covers, and the guarantee of a level of detail (design of errors: FORMAT.md, "Errors").
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/patch/description.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/special_values.h"

namespace intervale::testing {

// By sample: whether a tetrahedron holds it, with a tolerance for those that lie on its faces.
inline std::vector<bool> covered_samples(const Grid& g, const Mesh& mesh) {
  std::vector<bool> covered(g.sample_count());
  for (const auto& t : mesh.tets) {
    std::array<std::array<double, 3>, 4> p{};
    std::array<double, 3> lo{kInf, kInf, kInf}, hi{-kInf, -kInf, -kInf};
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < 3; ++k) {
        p[i][k] = (mesh.points[t[i]][k] - g.affine.origin()[k]) / g.affine.spacing()[k];
        lo[k] = std::min(lo[k], p[i][k]);
        hi[k] = std::max(hi[k], p[i][k]);
      }
    }
    const auto det = [](const auto& a, const auto& b, const auto& c, const auto& d) {
      double m[3][3];
      for (int k = 0; k < 3; ++k) m[0][k] = b[k] - a[k], m[1][k] = c[k] - a[k], m[2][k] = d[k] - a[k];
      return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
             m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    };
    const double whole = det(p[0], p[1], p[2], p[3]);
    if (whole <= 0) continue;
    for (int z = int(std::ceil(lo[2] - 1e-9)); z <= int(std::floor(hi[2] + 1e-9)); ++z) {
      for (int y = int(std::ceil(lo[1] - 1e-9)); y <= int(std::floor(hi[1] + 1e-9)); ++y) {
        for (int x = int(std::ceil(lo[0] - 1e-9)); x <= int(std::floor(hi[0] + 1e-9)); ++x) {
          const std::array<double, 3> q{double(x), double(y), double(z)};
          const double least = -1e-9;
          if (det(q, p[1], p[2], p[3]) < least || det(p[0], q, p[2], p[3]) < least || det(p[0], p[1], q, p[3]) < least ||
              det(p[0], p[1], p[2], q) < least)
            continue;
          covered[(std::size_t(z) * g.dims[1] + y) * g.dims[0] + x] = true;
        }
      }
    }
  }
  return covered;
}

// Every sample in [alpha + error, beta - error] is covered, and none outside [alpha - error, beta + error]: the first
// one for which that does not hold, or an empty text.
inline std::string broken_guarantee(const Volume& volume, const Mesh& mesh, const Range& range, double error) {
  const Grid& g = volume.grid;
  const std::vector<bool> covered = covered_samples(g, mesh);
  std::vector<double> values(covered.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = sample(volume, int(i % g.dims[0]), int(i / g.dims[0] % g.dims[1]), int(i / g.dims[0] / g.dims[1]));
  }
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  // A cut is rounded to a step of its edge: 1/256 of the difference of the values there, at most of the whole span.
  const double step = error + (*high - *low) / 128;
  for (std::size_t i = 0; i < covered.size(); ++i) {
    const double f = values[i];
    const bool must = f >= range.alpha + step && f <= range.beta - step, never = f < range.alpha - step || f > range.beta + step;
    if (covered[i] ? never : must) return "sample " + std::to_string(i) + ", value " + std::to_string(f);
  }
  return {};
}

}  // namespace intervale::testing
