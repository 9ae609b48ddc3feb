// Where the field crosses the surfaces of a range, in a diamond of class 0, which is a cube.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/patch/range.h"
#include "common/ranges/bisection.h"
#include "common/ranges/field.h"
#include "common/util/vec3.h"

namespace intervale {

// A surface: the field at alpha or at beta.
struct Isosurface {
  double value;
  bool is_beta;
  // Whether two samples lie on different sides of it. As in range.h: a sample equal to alpha or beta is inside.
  [[nodiscard]] bool separates(double a, double b) const { return is_beta ? (a > value) != (b > value) : (a < value) != (b < value); }
};

// The surfaces of a range: at its finite ends.
inline constexpr int kMaxSurfaces = 2;
struct Isosurfaces {
  explicit Isosurfaces(const Range& range) {
    if (std::isfinite(range.alpha)) surface[count++] = {range.alpha, false};
    if (std::isfinite(range.beta)) surface[count++] = {range.beta, true};
  }
  // Whether any of them has samples from `least` to `most` on both sides.
  [[nodiscard]] bool separate(double least, double most) const {
    return std::any_of(surface.begin(), surface.begin() + count, [=](const Isosurface& s) { return s.separates(least, most); });
  }
  std::array<Isosurface, kMaxSurfaces> surface{};
  int count = 0;
};

// Where a value lies between two others, 0 at `from` and 1 at `to`. Halved if their difference is more than a double holds.
[[nodiscard]] inline double part_of(double value, double from, double to) {
  const double whole = to - from;
  return std::isfinite(whole) ? (value - from) / whole : (value / 2 - from / 2) / (to / 2 - from / 2);
}

// A diamond of class 0.
struct Cube {
  // last: of the field, the largest coordinates in the box.
  Cube(const Diamond& d, Vertex last) : side(2 * d.h), scale(d.scale), low{d.centre.x - d.h, d.centre.y - d.h, d.centre.z - d.h}, start(d.vertex(0)) {
    flip = {start.x != low[0], start.y != low[1], start.z != low[2]};
    most = {last.x - low[0] - kInsideBox, last.y - low[1] - kInsideBox, last.z - low[2] - kInsideBox};
  }
  static constexpr double kInsideBox = 1.0 / (1 << 16);  // of a sample

  std::int32_t side;
  int scale;
  std::array<std::int32_t, 3> low;  // its lowest corner
  Vertex start;                     // of the spine
  std::array<bool, 3> flip;         // axes along which the spine descends
  // The largest coordinates from `low`: points in a far side of the box belong to the tetrahedra before it, not to
  // those behind, which clamping makes flat.
  Vec3 most;
};

// A point where the field crosses a surface: its barycentric coordinates in a tetrahedron.
using Crossing [[gnu::vector_size(4 * sizeof(float))]] = float;
// By path and surface.
using CubeCrossings = std::array<std::array<std::vector<Crossing>, kMaxSurfaces>, kPaths.size()>;

// Finds the crossings on the edges of the finest tetrahedra: in the cell from each sample on, one edge for each set of
// one, two or three axes. O(samples in the cube).
template <class T>
class CrossingFinder {
 public:
  // The field must outlive it.
  CrossingFinder(const Field<T>& field, const Isosurfaces& surfaces)
      : field_(field), surfaces_(surfaces), stride_{1, field.last.x + 1, std::ptrdiff_t(field.last.x + 1) * (field.last.y + 1)} {}

  [[nodiscard]] CubeCrossings find(const Cube& cube) const {
    CubeCrossings found;
    const Vertex last = field_.last;
    const auto [x0, y0, z0] = cube.low;
    const Vertex begin{std::max(0, x0), std::max(0, y0), std::max(0, z0)};
    const Vertex end{std::min(last.x, x0 + cube.side), std::min(last.y, y0 + cube.side), std::min(last.z, z0 + cube.side)};
    if (begin.x > end.x) return found;
    std::vector<T> least(std::size_t(end.x - begin.x) + 1), most(least.size());
    for (std::int32_t z = begin.z; z <= end.z; ++z) {
      for (std::int32_t y = begin.y; y <= end.y; ++y) {
        const T* const row = &field_.samples[field_.index({begin.x, y, z})];
        const unsigned at_end = unsigned(y == end.y) << 1 | unsigned(z == end.z) << 2;  // axes that lead out of the cube
        if (!find_extremes(row, at_end, least, most)) continue;
        for (std::size_t i = 0; i < least.size(); ++i) {
          const bool is_last = i + 1 == least.size();
          const std::size_t next = is_last ? i : i + 1;
          if (!surfaces_.separate(double(std::min(least[i], least[next])), double(std::max(most[i], most[next])))) continue;
          for (unsigned axes = 1; axes < 8; ++axes) {
            if ((axes & (at_end | unsigned(is_last))) == 0) add_edge(cube, row + i, {begin.x + std::int32_t(i), y, z}, axes, found);
          }
        }
      }
    }
    return found;
  }

 private:
  // The extremes of the samples at each x of a row and of the rows next to it on y and z. False if no surface crosses
  // them.
  bool find_extremes(const T* row, unsigned at_end, std::vector<T>& least, std::vector<T>& most) const {
    const std::size_t count = least.size();
    const T* const on_y = (at_end & 2) != 0 ? row : row + stride_[1];
    const std::ptrdiff_t z = (at_end & 4) != 0 ? 0 : stride_[2];
    const T *const on_z = row + z, *const on_both = on_y + z;
    T* const low = least.data();
    T* const high = most.data();
    for (std::size_t i = 0; i < count; ++i) {
      low[i] = std::min(std::min(row[i], on_y[i]), std::min(on_z[i], on_both[i]));
      high[i] = std::max(std::max(row[i], on_y[i]), std::max(on_z[i], on_both[i]));
    }
    T lowest = low[0], highest = high[0];
    for (std::size_t i = 1; i < count; ++i) {
      lowest = std::min(lowest, low[i]);
      highest = std::max(highest, high[i]);
    }
    return surfaces_.separate(double(lowest), double(highest));
  }

  // Crossings of one edge: in the cell from v on, along these axes, from the end where those coordinates are even to the
  // end where they are odd.
  void add_edge(const Cube& cube, const T* sample, const std::array<std::int32_t, 3>& v, unsigned axes, CubeCrossings& found) const {
    Vec3 even{}, odd{};  // the ends, from v
    const T *first = sample, *second = sample;
    for (int i = 0; i < 3; ++i) {
      if ((axes >> i & 1) == 0) continue;
      const bool back = (v[i] & 1) != 0;
      (back ? even : odd)[i] = 1;
      (back ? first : second) += stride_[i];
    }
    const double a = double(*first), b = double(*second);
    for (int k = 0; k < surfaces_.count; ++k) {
      const Isosurface& surface = surfaces_.surface[k];
      if (!surface.separates(a, b)) continue;
      const double t = part_of(surface.value, a, b);
      Vec3 p;  // in the cube, from 0 at the start of the spine to 1 at its end
      for (int i = 0; i < 3; ++i) {
        p[i] = std::min(v[i] - cube.low[i] + even[i] + t * (odd[i] - even[i]), cube.most[i]);
        p[i] = (cube.flip[i] ? cube.side - p[i] : p[i]) / cube.side;
      }
      const auto path =
          std::find_if(kPaths.begin(), kPaths.end(), [&p](const auto& axis) { return p[axis[0]] >= p[axis[1]] && p[axis[1]] >= p[axis[2]]; });
      const double x = p[(*path)[0]], y = p[(*path)[1]], z = p[(*path)[2]];
      found[std::size_t(path - kPaths.begin())][std::size_t(k)].push_back(Crossing{float(1 - x), float(x - y), float(y - z), float(z)});
    }
  }

  const Field<T>& field_;
  Isosurfaces surfaces_;
  std::array<std::ptrdiff_t, 3> stride_;  // between neighbouring samples along each axis
};

}  // namespace intervale
