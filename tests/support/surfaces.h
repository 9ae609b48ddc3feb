// Triangles as surfaces: points spread over them, and how far other points are from them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "common/mesh/mesh.h"
#include "tests/support/cameras.h"

namespace intervale::testing {

using Triangles = std::vector<std::array<Vector, 3>>;

inline Triangles triangles_of(const Mesh& mesh, const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  Triangles all;
  for (const auto& [a, b, c] : triangles) all.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
  return all;
}

// Evenly by area.
inline std::vector<Vector> points_on(const Triangles& triangles, int count, std::mt19937& random) {
  std::vector<double> area;
  for (const auto& [a, b, c] : triangles) area.push_back(length(cross(minus(b, a), minus(c, a))));
  std::discrete_distribution<std::size_t> any(area.begin(), area.end());
  std::vector<Vector> points;
  for (int i = 0; i < count; ++i) {
    const auto& [a, b, c] = triangles[any(random)];
    double u = uniform(random, 0, 1), v = uniform(random, 0, 1);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    points.push_back(along(along(a, u, minus(b, a)), v, minus(c, a)));
  }
  return points;
}

// The square of the distance to one triangle: to its plane's nearest point if that is inside, else to the nearest of
// its edges.
inline double square_distance(const Vector& p, const std::array<Vector, 3>& triangle) {
  const Vector n = cross(minus(triangle[1], triangle[0]), minus(triangle[2], triangle[0]));
  const double nn = dot(n, n);
  double best = std::numeric_limits<double>::infinity();
  bool inside = nn > 0;
  for (int i = 0; i < 3; ++i) {
    const Vector a = triangle[i], edge = minus(triangle[(i + 1) % 3], a), to = minus(p, a);
    inside = inside && dot(cross(edge, to), n) >= 0;
    const double ee = dot(edge, edge);
    const Vector off = minus(to, along({}, ee > 0 ? std::clamp(dot(to, edge) / ee, 0.0, 1.0) : 0.0, edge));
    best = std::min(best, dot(off, off));
  }
  if (!inside) return best;
  const double height = dot(minus(p, triangle[0]), n);
  return height * height / nn;
}

// The distance to the nearest of some triangles. They lie in cells of a regular grid, which are gone through from near
// to far.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const Triangles& triangles) : triangles_(triangles) {
    Vector high;
    low_.fill(std::numeric_limits<double>::infinity());
    high.fill(-low_[0]);
    for (const auto& triangle : triangles) {
      for (const Vector& p : triangle) {
        for (int i = 0; i < 3; ++i) low_[i] = std::min(low_[i], p[i]), high[i] = std::max(high[i], p[i]);
      }
    }
    for (int i = 0; i < 3; ++i) cell_ = std::max(cell_, (high[i] - low_[i]) / kCells);
    cells_.resize(kCells * kCells * kCells);
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      std::array<int, 3> from{kCells, kCells, kCells}, to{};
      for (const Vector& p : triangles[t]) {
        const auto c = cell_of(p);
        for (int i = 0; i < 3; ++i) from[i] = std::min(from[i], c[i]), to[i] = std::max(to[i], c[i]);
      }
      for_each(from, to, [&](const std::array<int, 3>& c) { cells_[number(c)].push_back(t); });
    }
  }

  [[nodiscard]] double operator()(const Vector& p) const {
    const auto middle = cell_of(p);
    double best = std::numeric_limits<double>::infinity();
    // What is r rings of cells away is at least r - 1 cells away, and so is p from those if it is outside the grid.
    for (int r = 0; r < kCells && (r - 1) * cell_ <= std::sqrt(best); ++r) {
      std::array<int, 3> from{}, to{};
      for (int i = 0; i < 3; ++i) from[i] = std::max(0, middle[i] - r), to[i] = std::min(kCells - 1, middle[i] + r);
      for_each(from, to, [&](const std::array<int, 3>& c) {
        if (std::max({std::abs(c[0] - middle[0]), std::abs(c[1] - middle[1]), std::abs(c[2] - middle[2])}) != r || gap2(p, c) > best) return;
        for (const std::uint32_t t : cells_[number(c)]) best = std::min(best, square_distance(p, triangles_[t]));
      });
    }
    return std::sqrt(best);
  }

 private:
  static constexpr int kCells = 32;
  [[nodiscard]] std::array<int, 3> cell_of(const Vector& p) const {
    std::array<int, 3> c{};
    for (int i = 0; i < 3; ++i) c[i] = int(std::clamp((p[i] - low_[i]) / cell_, 0.0, kCells - 1.0));
    return c;
  }
  [[nodiscard]] double gap2(const Vector& p, const std::array<int, 3>& c) const {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      const double at = (p[i] - low_[i]) / cell_, gap = cell_ * std::max({0.0, c[i] - at, at - (c[i] + 1)}) * (1 - 1e-9);
      sum += gap * gap;
    }
    return sum;
  }
  static std::size_t number(const std::array<int, 3>& c) { return std::size_t((c[2] * kCells + c[1]) * kCells + c[0]); }
  template <class Visit>
  static void for_each(const std::array<int, 3>& from, const std::array<int, 3>& to, Visit&& visit) {
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        for (int x = from[0]; x <= to[0]; ++x) visit({x, y, z});
      }
    }
  }
  const Triangles& triangles_;
  Vector low_{};
  double cell_ = 0;
  std::vector<std::vector<std::uint32_t>> cells_;
};

}  // namespace intervale::testing
