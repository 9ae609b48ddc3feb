// The error of a diamond: how far linear interpolation in its tetrahedra is from the samples inside them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <type_traits>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ranges/border_shape.h"
#include "common/ranges/extremes.h"
#include "common/ranges/field.h"
#include "common/util/bits.h"
#include "common/util/parallel.h"
#include "common/util/tetrahedron.h"
#include "common/util/vec3.h"

namespace intervale {

// The largest |F - interpolation| over rows of samples, along which the interpolant grows linearly.
template <class T, class Real>
class RowErrors {
 public:
  // Samples row[begin], ..., row[end - 1] against start + begin * step, start + (begin + 1) * step, ...
  void add(const T* row, int begin, int end, Real start, Real step) {
    if (end - begin < kLanes) {
      for (int i = begin; i < end; ++i) worst_ = std::max(worst_, std::abs(Real(row[i]) - (start + step * Real(i))));
      return;
    }
    for (; begin < end - kLanes; begin += kLanes) add_lanes(row, begin, start, step);
    add_lanes(row, end - kLanes, start, step);  // some a second time
  }
  [[nodiscard]] Real worst() const {
    Real all = worst_;
    for (Real w : lanes_) all = std::max(all, w);
    return all;
  }

 private:
  static constexpr int kLanes = sizeof(T) < 4 ? 8 : 4;  // samples at once, in rows that are long enough
  static constexpr std::array<Real, kLanes> kNumbers = [] {
    std::array<Real, kLanes> numbers{};
    for (int i = 0; i < kLanes; ++i) numbers[i] = Real(i);
    return numbers;
  }();
  void add_lanes(const T* row, int first, Real start, Real step) {
    const Real from = Real(first);
#pragma omp simd
    for (int i = 0; i < kLanes; ++i) lanes_[i] = std::max(lanes_[i], std::abs(Real(row[first + i]) - (start + step * (from + kNumbers[i]))));
  }
  std::array<Real, kLanes> lanes_{};
  Real worst_ = 0;
};

// One closed tetrahedron (not flat) with corners at samples.
template <class T>
class Tetrahedron {
 public:
  Tetrahedron(const Field<T>& field, const std::array<Vertex, 4>& p) : field_(field), p0_(p[0]) {
    for (int i = 0; i < 4; ++i) {
      const auto [a, b, c] = kTetFaces[i];
      n_[i] = cross(minus(p[b], p[a]), minus(p[c], p[a]));
      const std::int64_t g = std::gcd(std::gcd(n_[i][0], n_[i][1]), n_[i][2]);
      const std::int64_t sign = dot(n_[i], minus(p[i], p[a])) < 0 ? -g : g;
      for (std::int64_t& v : n_[i]) v /= sign;
      d_[i] = -dot(n_[i], minus(p[a], p[0]));
    }
    const I3 e1 = minus(p[1], p[0]), e2 = minus(p[2], p[0]), e3 = minus(p[3], p[0]);
    const I3 c1 = cross(e2, e3), c2 = cross(e3, e1), c3 = cross(e1, e2);
    const double det = double(dot(e1, c1));
    f0_ = field.at(p[0]);
    const double f1 = field.at(p[1]) - f0_, f2 = field.at(p[2]) - f0_, f3 = field.at(p[3]) - f0_;
    for (int k = 0; k < 3; ++k) gradient_[k] = (f1 * double(c1[k]) + f2 * double(c2[k]) + f3 * double(c3[k])) / det;
    for (const Vertex q : p) {
      const I3 at = minus(q, p[0]);
      for (int k = 0; k < 3; ++k) {
        low_[k] = std::min(low_[k], at[k]);
        high_[k] = std::max(high_[k], at[k]);
      }
      least_ = std::min(least_, field.at(q) - f0_);
      most_ = std::max(most_, field.at(q) - f0_);
    }
  }

  // The larger of `known` and the largest |F - linear interpolation| over all samples inside. O(blocks that its
  // bounding box meets + rows and samples of the blocks whose extremes allow more than that).
  [[nodiscard]] double error(const Extremes<T>& extremes, double known) const {
    constexpr std::int64_t side = Extremes<T>::kSide;
    if (!extremes.is_partial && high_[0] - low_[0] < 2 * side && high_[1] - low_[1] < 2 * side && high_[2] - low_[2] < 2 * side)
      return std::max(known, error_in(low_, high_));
    double worst = known;
    const I3 from{p0_.x, p0_.y, p0_.z};
    I3 first{}, last{};
    for (int k = 0; k < 3; ++k) {
      first[k] = (from[k] + low_[k]) / side;
      last[k] = (from[k] + high_[k]) / side;
    }
    const double rounding = 1e-12 * (std::abs(f0_) + std::abs(f0_ + least_) + std::abs(f0_ + most_));
    const double spread = (std::abs(gradient_[0]) + std::abs(gradient_[1]) + std::abs(gradient_[2])) * (double(side - 1) / 2);
    for (std::int64_t k = first[2]; k <= last[2]; ++k) {
      for (std::int64_t j = first[1]; j <= last[1]; ++j) {
        for (std::int64_t i = first[0]; i <= last[0]; ++i) {
          const I3 low{i * side - from[0], j * side - from[1], k * side - from[2]};
          const double half = double(side - 1) / 2;
          const double middle =
              gradient_[0] * (double(low[0]) + half) + gradient_[1] * (double(low[1]) + half) + gradient_[2] * (double(low[2]) + half);
          const double least = f0_ + std::max(least_, middle - spread), most = f0_ + std::min(most_, middle + spread);
          const auto [least_sample, most_sample] = extremes.at(std::int32_t(i), std::int32_t(j), std::int32_t(k));
          if (least_sample > most_sample) continue;  // left out
          if (std::max(double(most_sample) - least, most - double(least_sample)) + rounding <= worst) continue;
          if (!meets(low, side - 1)) continue;
          worst = std::max(worst, error_in(low, {low[0] + side - 1, low[1] + side - 1, low[2] + side - 1}));
        }
      }
    }
    return worst;
  }

 private:
  using I3 = std::array<std::int64_t, 3>;
  static I3 minus(Vertex a, Vertex b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }

  // Whether no face separates the cube [low, low + size] from the tetrahedron.
  [[nodiscard]] bool meets(const I3& low, std::int64_t size) const {
    for (int i = 0; i < 4; ++i) {
      std::int64_t r = d_[i];
      for (int k = 0; k < 3; ++k) r += n_[i][k] * (n_[i][k] > 0 ? low[k] + size : low[k]);
      if (r < 0) return false;
    }
    return true;
  }

  // The error over the samples of the box [low, high] that lie inside the tetrahedron.
  [[nodiscard]] double error_in(I3 low, I3 high) const {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::max(low[k], low_[k]);
      high[k] = std::min(high[k], high_[k]);
    }
    const std::int64_t stride_y = field_.last.x + 1, stride_z = stride_y * (field_.last.y + 1);
    const T* const origin = &field_.samples[field_.index(p0_)];
    RowErrors<T, double> rows;
    for (std::int64_t z = low[2]; z <= high[2]; ++z) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        std::int64_t lo = low_[0], hi = high_[0];
        for (int i = 0; i < 4; ++i) {
          const std::int64_t r = n_[i][1] * y + n_[i][2] * z + d_[i], nx = n_[i][0];
          if (nx == 0) {
            if (r < 0) hi = lo - 1;
          } else if (nx > 0) {
            lo = std::max(lo, nx == 1 ? -r : r <= 0 ? (-r + nx - 1) / nx : -(r / nx));
          } else {
            hi = std::min(hi, nx == -1 ? r : r >= 0 ? r / -nx : -((-r - nx - 1) / -nx));
          }
        }
        const std::int64_t begin = std::max(lo, low[0]), end = std::min(hi, high[0]) + 1;
        if (begin >= end) continue;
        rows.add(origin + (lo + y * stride_y + z * stride_z), int(begin - lo), int(end - lo),
                 f0_ + gradient_[1] * double(y) + gradient_[2] * double(z) + gradient_[0] * double(lo), gradient_[0]);
      }
    }
    return rows.worst();
  }

  const Field<T>& field_;
  Vertex p0_;              // the origin of all that follows
  std::array<I3, 4> n_{};  // half spaces n . q + d >= 0; the components of n have no common factor
  std::array<std::int64_t, 4> d_{};
  I3 low_{}, high_{};                     // bounding box
  double f0_ = 0, least_ = 0, most_ = 0;  // the value at p0, and the least and largest at the corners less that
  std::array<double, 3> gradient_{};
};

// One tetrahedron of a diamond type, for h = 1, with the centre as the origin.
struct TetPlan {
  // The gradient of the interpolant times h, [axis][i], from the values at spine end 0 and at both belt vertices, less
  // that at the spine's middle.
  std::array<std::array<double, 3>, 3> gradient{};
  // Half spaces n . q + d h >= open, those with n_x > 0 first, then those with n_x < 0. All of n and d are -1, 0 or 1.
  // Samples on a face between two tetrahedra are assigned to one of them.
  struct Face {
    std::array<std::int8_t, 3> n{};
    std::int8_t d = 0, open = 0;
  };
  std::array<Face, 4> face{};
  int lower = 0, upper = 0;  // faces that bound x from below, and from above
  std::array<std::int8_t, 3> low{}, high{};

  // Calls visit(y, z, first x, last x) for the rows of samples inside. shares: whether samples on a face belong to one
  // of its two tetrahedra only.
  template <class Visit>
  void for_each_row(int h, bool shares, Visit&& visit) const {
    // Faces that do not bound x bound y, or only z.
    std::array<int, 4> ny{}, nz{}, d{};
    for (int i = 0; i < 4; ++i) {
      ny[i] = face[i].n[1];
      nz[i] = face[i].n[2];
      d[i] = face[i].d * h - (shares ? face[i].open : 0);
    }
    for (int z = low[2] * h; z <= high[2] * h; ++z) {
      int first_y = low[1] * h, last_y = high[1] * h;
      for (int i = lower + upper; i < 4; ++i) {
        const int r = nz[i] * z + d[i];
        if (ny[i] > 0) first_y = std::max(first_y, -r);
        if (ny[i] < 0) last_y = std::min(last_y, r);
        if (ny[i] == 0 && r < 0) last_y = first_y - 1;
      }
      for (int y = first_y; y <= last_y; ++y) {
        const auto reach = [&](int i) { return ny[i] * y + nz[i] * z + d[i]; };
        int first = -reach(0), last = reach(lower);
        for (int i = 1; i < lower; ++i) first = std::max(first, -reach(i));
        for (int i = lower + 1; i < lower + upper; ++i) last = std::min(last, reach(i));
        if (first <= last) visit(y, z, first, last);
      }
    }
  }
};

// By type and tetrahedron.
[[nodiscard]] const std::array<std::array<TetPlan, kMaxTets>, 64>& tet_plans();

// Errors of the diamonds of one scale: error(delta) of the paper, section 4, over the samples of all their tetrahedra.
template <class T>
class DiamondErrors {
 public:
  DiamondErrors(const Field<T>& field, const Extremes<T>& extremes, const Domain& domain, int scale)
      : field_(field), extremes_(extremes), domain_(domain), scale_(scale), h_(1 << scale) {
    for (unsigned type = 0; type < 64 && scale <= kListed; ++type) {
      const DiamondType& row = diamond_type(type);
      if (scale == 0) {
        // Every sample inside is a vertex or the middle of an edge.
        for (int e = 0; e < row.edges; ++e) {
          const auto [a, b] = edge_ends(e, row.belt);
          const Offset p = row.vertex[a], q = row.vertex[b];
          if (((p.x + q.x) | (p.y + q.y) | (p.z + q.z)) & 1) continue;
          middles_.push_back({step((p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2), step(p.x, p.y, p.z), step(q.x, q.y, q.z)});
        }
        middles_end_[type + 1] = std::uint32_t(middles_.size());
        continue;
      }
      for (int i = 0; i < kMaxTets; ++i) {
        if (i < row.tets) {
          plans_[type][i].for_each_row(h_, true, [&](int y, int z, int first, int last) {
            runs_.push_back({step(first, y, z), last - first + 1, float(first), float(y), float(z)});
          });
        }
        runs_end_[type * kMaxTets + i + 1] = std::uint32_t(runs_.size());
      }
    }
  }

  // The error over a diamond's tetrahedra that exist and are in the mask.
  [[nodiscard]] double operator()(const Diamond& d, const BorderShape& shape, unsigned tets = ~0u) const {
    if (scale_ == 0) return shape.interior ? finest(d) : finest_moved(d, shape);
    double worst = 0;
    for (const int i : set_bits(tets & shape.tets)) {
      if (scale_ <= kSmall && (shape.unmoved >> i & 1)) {
        worst = std::max(worst, double(unmoved(d, i, shape.interior)));
      } else {
        worst = Tetrahedron<T>(field_, domain_.positions(d, d.row->tet(i))).error(extremes_, worst);
      }
    }
    return worst;
  }

 private:
  static constexpr int kSmall = 3;   // the coarsest scale whose tetrahedra are visited row by row, without blocks
  static constexpr int kListed = 2;  // the coarsest scale whose rows are listed in advance: finding short rows takes longer than visiting them
  // Up to scale kSmall, the 24 bits of a float hold every interpolant between samples of two bytes: halves of
  // differences, divided by h.
  using Real = std::conditional_t<sizeof(T) <= 2, float, double>;

  struct Middle {
    std::ptrdiff_t at, a, b;
  };
  struct Run {
    std::ptrdiff_t at;  // its first sample
    int count;
    float x, y, z;  // its position
  };

  [[nodiscard]] std::ptrdiff_t step(std::ptrdiff_t x, std::ptrdiff_t y, std::ptrdiff_t z) const {
    return (z * (field_.last.y + 1) + y) * (field_.last.x + 1) + x;
  }

  // A diamond inside the box, h = 1.
  [[nodiscard]] double finest(const Diamond& d) const {
    const T* const centre = &field_.samples[field_.index(d.centre)];
    double worst = 0;
    for (std::uint32_t i = middles_end_[d.type]; i < middles_end_[d.type + 1]; ++i) {
      const Middle m = middles_[i];
      worst = std::max(worst, std::abs(double(centre[m.at]) - (double(centre[m.a]) / 2 + double(centre[m.b]) / 2)));
    }
    return worst;
  }

  // A diamond at the border, h = 1: every sample inside is a vertex or the middle of an edge there, too.
  [[nodiscard]] double finest_moved(const Diamond& d, const BorderShape& shape) const {
    double worst = 0;
    for (const int e : set_bits(shape.edges)) {
      const auto [i, k] = edge_ends(e, d.row->belt);
      const Vertex a = domain_.clamp(d.vertex(i)), b = domain_.clamp(d.vertex(k)), both{a.x + b.x, a.y + b.y, a.z + b.z};
      if ((both.x | both.y | both.z) & 1) continue;
      const double middle = field_.at({both.x / 2, both.y / 2, both.z / 2});
      worst = std::max(worst, std::abs(middle - (field_.at(a) / 2 + field_.at(b) / 2)));
    }
    return worst;
  }

  // One tetrahedron with all its vertices in the box. interior: so are all others; each face belongs to one of them.
  [[nodiscard]] Real unmoved(const Diamond& d, int tet, bool interior) const {
    const T* const origin = field_.samples.data() + field_.index(d.centre);
    const TetPlan& plan = plans_[d.type][tet];
    const auto local = d.row->tet(tet);
    const auto at = [&](int v) {
      const Offset f = d.row->vertex[v];
      return Real(origin[step(f.x, f.y, f.z) * h_]);
    };
    const Real middle = at(0) / 2 + at(1) / 2, f0 = at(0) - middle, f1 = at(local[2]) - middle, f2 = at(local[3]) - middle;
    std::array<Real, 3> g{};
    for (int k = 0; k < 3; ++k) g[k] = (Real(plan.gradient[k][0]) * f0 + Real(plan.gradient[k][1]) * f1 + Real(plan.gradient[k][2]) * f2) / Real(h_);
    RowErrors<T, Real> rows;
    if (scale_ <= kListed && interior) {
      const std::size_t n = d.type * kMaxTets + std::size_t(tet);
      for (std::uint32_t i = runs_end_[n]; i < runs_end_[n + 1]; ++i) {
        const Run& r = runs_[i];
        rows.add(origin + r.at, 0, r.count, middle + g[2] * Real(r.z) + g[1] * Real(r.y) + g[0] * Real(r.x), g[0]);
      }
    } else {
      plan.for_each_row(h_, interior, [&](int y, int z, int first, int last) {
        rows.add(origin + step(first, y, z), 0, last - first + 1, middle + g[2] * Real(z) + g[1] * Real(y) + g[0] * Real(first), g[0]);
      });
    }
    return rows.worst();
  }

  const Field<T>& field_;
  const Extremes<T>& extremes_;
  const Domain& domain_;
  int scale_;
  std::int32_t h_;
  const std::array<std::array<TetPlan, kMaxTets>, 64>& plans_ = tet_plans();
  std::vector<Middle> middles_;
  std::array<std::uint32_t, 65> middles_end_{};
  std::vector<Run> runs_;
  std::array<std::uint32_t, 64 * kMaxTets + 1> runs_end_{};
};

}  // namespace intervale
