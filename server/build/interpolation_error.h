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

// The largest |F - linear interpolation| over all samples in one closed tetrahedron (not flat) with corners at samples. O(rows of its bounding box +
// samples inside).
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

  // Rows go along x, where samples are neighbours in memory, unless the tetrahedron is much longer elsewhere.
  std::array<std::int64_t, 3> low{}, high{}, stride{1, field.last.x + 1, std::int64_t(field.last.x + 1) * (field.last.y + 1)};  // of q - p0
  for (int i = 1; i < 4; ++i) {
    const I3 q = minus(p[i], p[0]);
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], q[k]);
      high[k] = std::max(high[k], q[k]);
    }
  }
  int u = 0;
  for (int k = 1; k < 3; ++k) {
    if (high[k] - low[k] > 8 * (high[u] - low[u] + 1)) u = k;
  }
  const int v = (u + 1) % 3, w = (u + 2) % 3;
  const T* const origin = &field.samples[field.index(p[0])];
  double worst = 0;
  for (std::int64_t c = low[w]; c <= high[w]; ++c) {
    for (std::int64_t b = low[v]; b <= high[v]; ++b) {
      std::int64_t lo = low[u], hi = high[u];
      for (int i = 0; i < 4; ++i) {
        const std::int64_t r = n[i][v] * b + n[i][w] * c + d[i], nu = n[i][u];
        if (nu == 0) {
          if (r < 0) hi = lo - 1;
        } else if (nu > 0) {
          lo = std::max(lo, nu == 1 ? -r : r <= 0 ? (-r + nu - 1) / nu : -(r / nu));
        } else {
          hi = std::min(hi, nu == -1 ? r : r >= 0 ? r / -nu : -((-r - nu - 1) / -nu));
        }
      }
      if (lo > hi) continue;
      const T* const row = origin + (lo * stride[u] + b * stride[v] + c * stride[w]);
      const double start = f0 + g[v] * double(b) + g[w] * double(c) + g[u] * double(lo);
      const int count = int(hi - lo) + 1;
      double most = 0;
      if (u == 0) {
#pragma omp simd reduction(max : most)
        for (int i = 0; i < count; ++i) most = std::max(most, std::abs(double(row[i]) - (start + g[0] * i)));
      } else {
        for (int i = 0; i < count; ++i) most = std::max(most, std::abs(double(row[i * stride[u]]) - (start + g[u] * i)));
      }
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
