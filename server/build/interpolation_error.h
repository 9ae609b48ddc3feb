// How well a diamond's tetrahedra stand for the samples inside them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>

#include "common/domain.h"

namespace intervale {

// Samples of type T, found by vertices inside the box.
template <class T>
struct Field {
  std::span<const T> samples;
  Vertex last;
  [[nodiscard]] std::size_t index(Vertex v) const {
    return (std::size_t(v.z) * std::size_t(last.y + 1) + std::size_t(v.y)) * std::size_t(last.x + 1) + std::size_t(v.x);
  }
  [[nodiscard]] double at(Vertex v) const { return double(samples[index(v)]); }
};

// The largest |F - linear interpolation| over all samples in one closed tetrahedron (not flat) with corners at samples. O(its bounding rectangle
// in y and z + samples inside).
template <class T>
double tet_error(const Field<T>& field, const std::array<Vertex, 4>& p) {
  using I3 = std::array<std::int64_t, 3>;
  const auto minus = [](Vertex a, Vertex b) { return I3{a.x - b.x, a.y - b.y, a.z - b.z}; };
  const auto cross = [](const I3& a, const I3& b) { return I3{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; };
  const auto dot = [](const I3& a, const I3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  // The four half spaces n . (q - p0) + d >= 0, n without a common factor.
  constexpr int others[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};
  std::array<I3, 4> n{};
  std::array<std::int64_t, 4> d{};
  for (int i = 0; i < 4; ++i) {
    const auto [a, b, c] = others[i];
    n[i] = cross(minus(p[b], p[a]), minus(p[c], p[a]));
    const std::int64_t g = std::gcd(std::gcd(n[i][0], n[i][1]), n[i][2]);
    const std::int64_t sign = dot(n[i], minus(p[i], p[a])) < 0 ? -g : g;
    for (std::int64_t& v : n[i]) v /= sign;
    d[i] = -dot(n[i], minus(p[a], p[0]));
  }
  // The gradient of the interpolant.
  const I3 e1 = minus(p[1], p[0]), e2 = minus(p[2], p[0]), e3 = minus(p[3], p[0]);
  const I3 c1 = cross(e2, e3), c2 = cross(e3, e1), c3 = cross(e1, e2);
  const double det = double(dot(e1, c1));
  const double f0 = field.at(p[0]), f1 = field.at(p[1]) - f0, f2 = field.at(p[2]) - f0, f3 = field.at(p[3]) - f0;
  std::array<double, 3> g{};
  for (int k = 0; k < 3; ++k) g[k] = (f1 * double(c1[k]) + f2 * double(c2[k]) + f3 * double(c3[k])) / det;

  const auto [x0, x1] = std::minmax({p[0].x, p[1].x, p[2].x, p[3].x});
  const auto [y0, y1] = std::minmax({p[0].y, p[1].y, p[2].y, p[3].y});
  const auto [z0, z1] = std::minmax({p[0].z, p[1].z, p[2].z, p[3].z});
  double worst = 0;
  for (std::int32_t z = z0; z <= z1; ++z) {
    for (std::int32_t y = y0; y <= y1; ++y) {
      std::int64_t lo = x0 - p[0].x, hi = x1 - p[0].x;  // of x - p0.x
      for (int i = 0; i < 4; ++i) {
        const std::int64_t r = n[i][1] * (y - p[0].y) + n[i][2] * (z - p[0].z) + d[i], nx = n[i][0];
        if (nx == 0) {
          if (r < 0) hi = lo - 1;
        } else if (nx > 0) {
          lo = std::max(lo, nx == 1 ? -r : r <= 0 ? (-r + nx - 1) / nx : -(r / nx));
        } else {
          hi = std::min(hi, nx == -1 ? r : r >= 0 ? r / -nx : -((-r - nx - 1) / -nx));
        }
      }
      if (lo > hi) continue;
      const T* const row = &field.samples[field.index({std::int32_t(p[0].x + lo), y, z})];
      const double start = f0 + g[1] * (y - p[0].y) + g[2] * (z - p[0].z) + g[0] * double(lo);
      const int count = int(hi - lo) + 1;
      double most = 0;
#pragma omp simd reduction(max : most)
      for (int i = 0; i < count; ++i) most = std::max(most, std::abs(double(row[i]) - (start + g[0] * i)));
      worst = std::max(worst, most);
    }
  }
  return worst;
}

// The same over a diamond's tetrahedra: error(delta) of the paper, section 4. tets: those that exist, not none.
template <class T>
double diamond_error(const Field<T>& field, const Domain& domain, const Diamond& d, unsigned tets) {
  if (d.row->cls == 2 && d.h == 1 && domain.is_interior(d)) {  // nothing but the centre is inside
    return std::abs(field.at(d.centre) - (field.at(d.vertex(0)) / 2 + field.at(d.vertex(1)) / 2));
  }
  double worst = 0;
  for (int i = 0; i < d.row->tets; ++i) {
    if (tets >> i & 1) worst = std::max(worst, tet_error(field, domain.positions(d, d.row->tet(i))));
  }
  return worst;
}

}  // namespace intervale
