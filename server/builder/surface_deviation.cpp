#include "server/builder/surface_deviation.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <optional>
#include <span>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"
#include "common/util/round_up.h"
#include "common/util/vec3.h"
#include "server/builder/bisection.h"
#include "server/builder/interpolation_error.h"

namespace intervale {
namespace {

constexpr int kTopScale = 4;  // cubes of this scale are searched one by one; coarser diamonds keep their width

// Of a top cube's width: the distance to the next patch where no diamond of the cube has one.
constexpr double kUnknownDistance = kMaxFarDeviation / (1 << kTopScale);
constexpr double kFarWidths = 2.01;             // a patch further away than so many widths of the diamond is far
constexpr double kLeastDeviation = 1e-4;        // of the finest diamonds' width: smaller deviations count as 0
constexpr double kInsideBox = 1.0 / (1 << 16);  // of a sample: points in the far sides of the box are moved so far into it

// Sums of squared deviations are whole numbers, so that their order does not matter.
constexpr double kRemovedOne = 1 << 20;

using Tet = BisectionTet;

// Where a value lies between two others, 0 at `from` and 1 at `to`. Halved if their difference is more than a double holds.
double part_of(double value, double from, double to) {
  const double whole = to - from;
  return std::isfinite(whole) ? (value - from) / whole : (value / 2 - from / 2) / (to / 2 - from / 2);
}

// A point where the field crosses a surface.
struct Crossing {
  std::array<float, 4> at;  // barycentric coordinates
  int surface;
};

// A surface: the field at alpha or at beta.
struct Isovalue {
  double value;
  bool is_beta;
  // Whether two samples lie on different sides of it. As in range.h: a sample equal to alpha or beta is inside.
  [[nodiscard]] bool separates(double a, double b) const { return is_beta ? (a > value) != (b > value) : (a < value) != (b < value); }
};

// The tetrahedra of a cube follow the paths along its edges from one end of the spine to the other: the axes in order.
constexpr std::array<std::array<int, 3>, 6> kPaths{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};
using CrossingsByTet = std::array<std::vector<Crossing>, kPaths.size()>;

// A diamond of class 0, which is a cube.
struct Cube {
  Cube(const Diamond& d, Vertex last) : side(2 * d.h), scale(d.scale), low{d.centre.x - d.h, d.centre.y - d.h, d.centre.z - d.h}, start(d.vertex(0)) {
    flip = {start.x != low[0], start.y != low[1], start.z != low[2]};
    most = {last.x - low[0] - kInsideBox, last.y - low[1] - kInsideBox, last.z - low[2] - kInsideBox};
  }
  std::int32_t side;
  int scale;
  std::array<std::int32_t, 3> low;  // its lowest corner
  Vertex start;                     // of the spine
  std::array<bool, 3> flip;         // axes along which the spine descends
  // The largest coordinates from `low`: points in a far side of the box belong to the tetrahedra before it, not to
  // those behind, which clamping makes flat.
  Vec3 most;
};

// Sets a shared number to the larger of it and `value`.
void raise(float& to, float value) {
  std::atomic_ref<float> shared(to);
  float seen = shared.load(std::memory_order_relaxed);
  while (seen < value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

// The mean of fractions from 0 to 1, the same whatever their order: their sum in fixed point and, in the low bits,
// their count.
class Mean {
 public:
  // Fewer than 2^kCountBits times; from any thread.
  void add(double fraction) {
    const double capped = fraction < 1 ? fraction : 1;
    std::atomic_ref<std::uint64_t>(bits_).fetch_add(std::uint64_t(capped * kOne) << kCountBits | 1, std::memory_order_relaxed);
  }
  [[nodiscard]] double value() const { return bits_ == 0 ? 0 : double(bits_ >> kCountBits) / double(bits_ & ((1u << kCountBits) - 1)) / kOne; }

 private:
  static constexpr int kCountBits = 16, kOne = 1 << 20;
  std::uint64_t bits_ = 0;
};

// Takes the crossings of each cube down its bisection, and records how far each diamond's patches are from them.
template <class T>
class Descent {
 public:
  Descent(const Field<T>& field, const Range& range, const Grid& grid, const Domain& domain, const SupercubeSet& set, std::vector<float>& largest,
          std::vector<Mean>& means, std::vector<std::int64_t>& removed)
      : field_(field),
        affine_(grid.affine),
        inverse_(grid.affine.inverse()),
        domain_(domain),
        set_(set),
        largest_(largest),
        means_(means),
        removed_(removed),
        width_(diamond_width(grid)) {
    if (std::isfinite(range.alpha)) surface_[surfaces_++] = {range.alpha, false};
    if (std::isfinite(range.beta)) surface_[surfaces_++] = {range.beta, true};
    if (surfaces_ > 0) zero_ = surface_[0].value;
    for (int k = 0; k < surfaces_; ++k) isovalue_[k] = float(surface_[k].value - zero_);
  }

  // Everything inside one diamond of class 0.
  void measure(const Diamond& d) const {
    const Cube cube(d, field_.last);
    CrossingsByTet crossings = crossings_in(cube);
    NearByScale near;
    near.inside = domain_.is_interior(d);
    const double unknown = kUnknownDistance * width_ * double(d.h);
    for (std::size_t t = 0; t < kPaths.size(); ++t) {
      if (!crossings[t].empty()) descend(tet_of(cube, kPaths[t]), crossings[t], {unknown, unknown}, near);
    }
  }

  // The distance from where a patch cuts a diamond's spine to the nearest crossing of the field on it, in world units.
  [[nodiscard]] double measure_tip(const Diamond& d) const {
    const Vertex a = d.vertex(0), b = d.vertex(1);
    if (!domain_.contains(a) || !domain_.contains(b)) return 0;
    const Vertex step{(b.x - a.x) / (2 * d.h), (b.y - a.y) / (2 * d.h), (b.z - a.z) / (2 * d.h)};
    const T* const samples = &field_.samples[field_.index(a)];
    const std::ptrdiff_t stride = &field_.samples[field_.index({a.x + step.x, a.y + step.y, a.z + step.z})] - samples;
    const int steps = 2 * d.h;
    double far = 0;
    for (int k = 0; k < surfaces_; ++k) {
      const double isovalue = surface_[k].value, first = double(samples[0]), last = double(samples[steps * stride]);
      if (!surface_[k].separates(first, last)) continue;
      const double cut = steps * part_of(isovalue, first, last);
      double nearest = steps;
      for (int i = 0; i < steps; ++i) {
        const double u = double(samples[i * stride]), w = double(samples[(i + 1) * stride]);
        if (surface_[k].separates(u, w)) nearest = std::min(nearest, std::abs(i + part_of(isovalue, u, w) - cut));
      }
      far = std::max(far, nearest);
    }
    return far * length(affine_.direction({double(step.x), double(step.y), double(step.z)}));
  }

 private:
  using Strides = std::array<std::ptrdiff_t, 3>;  // between neighbouring samples along each axis

  // The crossings on the edges of the finest tetrahedra: in the cell from each sample on, one edge for each set of one,
  // two or three axes.
  [[nodiscard]] CrossingsByTet crossings_in(const Cube& cube) const {
    CrossingsByTet found;
    const Vertex last = field_.last;
    const Strides stride{1, last.x + 1, std::ptrdiff_t(last.x + 1) * (last.y + 1)};
    const auto [x0, y0, z0] = cube.low;
    const Vertex begin{std::max(0, x0), std::max(0, y0), std::max(0, z0)};
    const Vertex end{std::min(last.x, x0 + cube.side), std::min(last.y, y0 + cube.side), std::min(last.z, z0 + cube.side)};
    for (std::int32_t z = begin.z; z <= end.z; ++z) {
      for (std::int32_t y = begin.y; y <= end.y; ++y) {
        const T* const row = &field_.samples[field_.index({0, y, z})];
        for (std::int32_t x = begin.x; x <= end.x; ++x) {
          const unsigned at_end = unsigned(x == end.x) | unsigned(y == end.y) << 1 | unsigned(z == end.z) << 2;  // axes that lead out of the cube
          if (at_end == 0 && !is_crossed(row + x, stride)) continue;
          for (unsigned axes = 1; axes < 8; ++axes) {
            if ((axes & at_end) == 0) add_crossings(cube, row + x, {x, y, z}, axes, stride, found);
          }
        }
      }
    }
    return found;
  }

  // Whether a cell's eight samples, from the lowest one on, lie on different sides of a surface.
  [[nodiscard]] bool is_crossed(const T* sample, const Strides& stride) const {
    T least = *sample, most = *sample;
    for (unsigned corner = 1; corner < 8; ++corner) {
      const T value = sample[(corner & 1 ? stride[0] : 0) + (corner & 2 ? stride[1] : 0) + (corner & 4 ? stride[2] : 0)];
      least = std::min(least, value);
      most = std::max(most, value);
    }
    for (int k = 0; k < surfaces_; ++k) {
      if (surface_[k].separates(double(least), double(most))) return true;
    }
    return false;
  }

  // Those of one edge: in the cell from v on, along these axes, from the end where those coordinates are even to the
  // end where they are odd.
  void add_crossings(const Cube& cube, const T* sample, const std::array<std::int32_t, 3>& v, unsigned axes, const Strides& stride,
                     CrossingsByTet& found) const {
    Vec3 even{}, odd{};  // the ends, from v
    const T *first = sample, *second = sample;
    for (int i = 0; i < 3; ++i) {
      if ((axes >> i & 1) == 0) continue;
      const bool back = (v[i] & 1) != 0;
      (back ? even : odd)[i] = 1;
      (back ? first : second) += stride[i];
    }
    const double a = double(*first), b = double(*second);
    for (int k = 0; k < surfaces_; ++k) {
      if (!surface_[k].separates(a, b)) continue;
      const double t = part_of(surface_[k].value, a, b);
      Vec3 p;  // in the cube, from 0 at the start of the spine to 1 at its end
      for (int i = 0; i < 3; ++i) {
        p[i] = std::min(v[i] - cube.low[i] + even[i] + t * (odd[i] - even[i]), cube.most[i]);
        p[i] = (cube.flip[i] ? cube.side - p[i] : p[i]) / cube.side;
      }
      const auto path =
          std::find_if(kPaths.begin(), kPaths.end(), [&p](const auto& axis) { return p[axis[0]] >= p[axis[1]] && p[axis[1]] >= p[axis[2]]; });
      const double x = p[(*path)[0]], y = p[(*path)[1]], z = p[(*path)[2]];
      found[std::size_t(path - kPaths.begin())].push_back({{float(1 - x), float(x - y), float(y - z), float(z)}, k});
    }
  }

  [[nodiscard]] Tet tet_of(const Cube& cube, const std::array<int, 3>& path) const {
    Tet tet{{}, cube.scale, 0, {}, {}};
    Vertex v = cube.start;
    tet.corner[0] = {v, float(value(v))};
    for (int i = 0; i < 3; ++i) {
      const int axis = path[i];
      std::int32_t& c = axis == 0 ? v.x : axis == 1 ? v.y : v.z;
      c += cube.flip[axis] ? -cube.side : cube.side;
      tet.corner[i + 1] = {v, float(value(v))};
      const double inverse = (cube.flip[axis] ? -1.0 : 1.0) / cube.side;
      tet.weight[i][axis] -= inverse;
      tet.weight[i + 1][axis] = inverse;
      tet.gradient[axis] = (double(tet.corner[i + 1].value) - double(tet.corner[i].value)) * inverse;
    }
    for (Vec3& weight : tet.weight) weight = inverse_.transposed(weight);
    tet.gradient = inverse_.transposed(tet.gradient);
    return tet;
  }

  [[nodiscard]] double value(Vertex v) const { return field_.at(domain_.clamp(v)) - zero_; }

  // The supercube of each scale that was looked up last: the next diamond is mostly in it too.
  struct Near {
    Vertex position{-1, -1, -1};
    std::uint64_t occupancy = 0;
    SupercubeIndex supercube;
    UpdateIndex first;
  };
  struct NearByScale : std::array<Near, kTopScale + 1> {
    bool inside = false;  // the cube lies in the box
  };

  [[nodiscard]] std::optional<UpdateIndex> find(Vertex centre, int scale, NearByScale& near) const {
    Near& here = near[std::size_t(scale)];
    const Vertex position{centre.x >> (scale + 2), centre.y >> (scale + 2), centre.z >> (scale + 2)};
    if (here.position != position) {
      const auto found = set_.find_supercube(scale, position);
      here = found ? Near{position, set_.occupancy()[found->supercube], found->supercube, set_.first(found->brick, found->supercube)}
                   : Near{position, 0, {}, {}};
    }
    const Slot slot = kSlotOfType[type_of(centre, scale)];
    if (!(here.occupancy >> slot & 1)) return {};
    return here.first + count_below(here.occupancy, slot);
  }

  // Whether the tetrahedron, or at least its diamond, has a patch of that surface.
  [[nodiscard]] bool has_patch(const Tet& tet, Vertex centre, const Isovalue& surface) const {
    const double first = tet.corner[0].value + zero_;
    for (int i = 1; i < 4; ++i) {
      if (surface.separates(first, tet.corner[i].value + zero_)) return true;
    }
    const Diamond diamond(centre);
    for (int i = 0; i < diamond.row->vertices; ++i) {
      if (surface.separates(first, value(diamond.vertex(i)) + zero_)) return true;
    }
    return false;
  }

  // By surface: how far the next patch is, at most, from any point here, as far as coarser diamonds know.
  using Nearest = std::array<double, 2>;

  // Records what the crossings in a tetrahedron say of its diamond, and narrows `nearest` where there is a patch. Returns
  // the sum of the squares of their deviations, in squares of width_.
  double record(const Tet& tet, Vertex centre, UpdateIndex update, std::span<const Crossing> crossings, Nearest& nearest,
                const NearByScale& near) const {
    const std::array<float, 4> values{tet.corner[0].value, tet.corner[1].value, tet.corner[2].value, tet.corner[3].value};
    double alpha_off = -1, beta_off = -1, sum = 0;  // the largest differences of the interpolant from each surface's value; -1: no crossing
    std::array<double, 2> squares{};                // of the differences, their sum; by surface
    std::array<int, 2> count{};
    for (const Crossing& c : crossings) {
      float at = 0;
      for (int i = 0; i < 4; ++i) at += c.at[i] * values[i];
      const double here = std::abs(at - isovalue_[c.surface]);
      alpha_off = std::max(alpha_off, c.surface == 0 ? here : -1.0);
      beta_off = std::max(beta_off, c.surface == 0 ? -1.0 : here);
      sum += here;
      squares[std::size_t(c.surface)] += here * here;
      ++count[std::size_t(c.surface)];
    }
    const double width = width_ * double(1 << tet.scale);
    const bool is_moved =
        !near.inside && !std::all_of(tet.corner.begin(), tet.corner.end(), [&](const Tet::Corner& c) { return domain_.contains(c.at); });
    const double slope = is_moved ? 0 : std::sqrt(dot(tet.gradient, tet.gradient));
    const std::array<double, 2> off{alpha_off, beta_off};
    double largest = 0, sum_of_squares = 0;
    for (int k = 0; k < surfaces_; ++k) {
      if (off[k] < 0) continue;
      if (is_moved || has_patch(tet, centre, surface_[k])) {
        nearest[k] = width;
        largest = std::max(largest, off[k] < width * slope ? off[k] / slope : width);
        const double most = count[k] * width * width;
        sum_of_squares += squares[k] < most * slope * slope ? squares[k] / (slope * slope) : most;
      } else {
        const double far = nearest[k] > kFarWidths * width ? nearest[k] : width;
        largest = std::max(largest, far);
        sum_of_squares += count[k] * far * far;
      }
    }
    if (largest > kLeastDeviation * width_) raise(largest_[update], round_up(largest));
    if (!is_moved) means_[near[std::size_t(tet.scale)].supercube].add(sum / double(crossings.size()) / (width * slope));
    return sum_of_squares / (width_ * width_);
  }

  // Returns what record() does.
  double descend(const Tet& tet, std::span<Crossing> crossings, Nearest nearest, NearByScale& near) const {
    const int tail = tet.tail();
    const Vertex a = tet.corner[0].at, b = tet.corner[tail].at;
    const Vertex centre{(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    const auto update = find(centre, tet.scale, near);
    if (!update) return 0;
    const double before = record(tet, centre, *update, crossings, nearest, near);
    double after = 0;
    if (tet.scale > 0 || tet.cls < 2) after = descend_into_halves(tet, {centre, float(value(centre))}, crossings, nearest, near);
    std::atomic_ref<std::int64_t>(removed_[*update]).fetch_add(std::llround((before - after) * kRemovedOne), std::memory_order_relaxed);
    return before;
  }

  double descend_into_halves(const Tet& tet, const Tet::Corner& middle, std::span<Crossing> crossings, const Nearest& nearest,
                             NearByScale& near) const {
    const int tail = tet.tail();
    double sum = 0;
    const auto end_of_first = std::partition(crossings.begin(), crossings.end(), [tail](const Crossing& c) { return c.at[0] >= c.at[tail]; });
    const auto split = std::size_t(end_of_first - crossings.begin());
    const std::span<Crossing> first = crossings.first(split), second = crossings.subspan(split);
    if (!first.empty()) {
      for (Crossing& c : first) {
        c.at[0] -= c.at[tail];
        c.at[tail] *= 2;
      }
      sum += descend(half_at_start(tet, middle), first, nearest, near);
    }
    if (!second.empty()) {
      for (Crossing& c : second) {
        const float head = c.at[0];
        const float rest = c.at[tail] - head;
        for (int i = 0; i + 1 < tail; ++i) c.at[i] = c.at[i + 1];
        c.at[tail - 1] = rest;
        c.at[tail] = 2 * head;
      }
      sum += descend(half_at_end(tet, middle), second, nearest, near);
    }
    return sum;
  }

  const Field<T>& field_;
  Affine affine_, inverse_;  // of the grid
  const Domain& domain_;
  const SupercubeSet& set_;
  std::vector<float>& largest_;         // by update
  std::vector<Mean>& means_;            // by supercube: deviations in its tetrahedra over the diamonds' width
  std::vector<std::int64_t>& removed_;  // by update, in squares of width_ / kRemovedOne
  double width_;                        // of a diamond with h = 1
  std::array<Isovalue, 2> surface_{};
  std::array<float, 2> isovalue_{};  // counted from zero_
  int surfaces_ = 0;
  double zero_ = 0;  // values in tetrahedra are counted from it, so that floats are precise enough
};

}  // namespace

SurfaceDeviation surface_deviation(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set,
                                   const ParallelFor& parallel) {
  SurfaceDeviation result{std::vector<float>(set.size(), 0), std::vector<float>(set.supercubes()), std::vector<double>(set.size()), 0};
  std::vector<std::int64_t> removed(set.size());
  std::vector<float>& largest = result.largest;
  std::vector<Mean> means(set.supercubes());
  const int top = std::min(kTopScale, domain.levels() - 1);
  result.top_scale = top;
  const double width = diamond_width(volume.grid);
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain.last()};
    const Descent<T> descent(field, range, volume.grid, domain, set, largest, means, removed);
    std::vector<Diamond> cubes;  // shared out one by one: they are few, and bricks even fewer
    set.for_each(top, 0, [&](const Place& p) { cubes.emplace_back(set.centre(p)); });
    parallel(cubes.size(), [&](std::size_t i) { descent.measure(cubes[i]); });
    parallel(set.bricks().size(), [&](std::size_t b) {
      set.for_each_in_brick(BrickIndex(std::uint32_t(b)), ~std::uint64_t(0), [&](const Place& p) {
        const double tip = descent.measure_tip(Diamond(SupercubeSet::centre(p), scale_of_key(p.key), kTypeOfSlot[p.slot]));
        if (tip > kLeastDeviation * width) largest[p.index] = std::max(largest[p.index], round_up(tip));
      });
    });
  });
  const Vec3 spacing = volume.grid.affine.spacing();
  const double unit = width / std::min({spacing[0], spacing[1], spacing[2]});
  for (UpdateIndex i{0}; i < set.size(); ++i) result.removed[i] = double(removed[i]) / kRemovedOne * unit * unit;
  for (int scale = top + 1; scale < domain.levels(); ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (BrickIndex b = begin; b < end; ++b)
      set.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) { largest[p.index] = round_up(width * double(1 << scale)); });
  }
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(
        b, [&](SupercubeIndex s, SupercubeKey key) { result.mean[s] = float(means[s].value() * width * double(1 << scale_of_key(key))); });
  }
  return result;
}

}  // namespace intervale
