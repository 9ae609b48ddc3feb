#include "common/ranges/surface_deviation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>

#include "common/ivm/interval_volume.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/bisection.h"
#include "common/ranges/crossing_measure.h"
#include "common/ranges/cube_crossings.h"
#include "common/ranges/field.h"
#include "common/ranges/patch_measure.h"
#include "common/util/atomic_ref.h"
#include "common/util/bits.h"
#include "common/util/round_up.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

// Cubes of kTopScale are searched one by one; coarser diamonds keep their width. Of such a cube's width: the distance to
// the next patch where no diamond of the cube has one.
constexpr double kUnknownDistance = kMaxFarDeviation / (1 << kTopScale);
constexpr double kFarWidths = 2.01;       // a patch further away than so many widths of the diamond is far
constexpr double kLeastDeviation = 1e-4;  // of the finest diamonds' width: smaller deviations count as 0

// Sums of squared deviations are whole numbers, so that their order does not matter. Where a grid is so large or so small
// that they are not finite, they say nothing.
constexpr double kRemovedOne = 1 << 20;
std::int64_t whole(double value) {
  constexpr double kMost = 1LL << 62;
  if (std::isnan(value)) return 0;
  return std::int64_t(std::clamp(value < 0 ? value - 0.5 : value + 0.5, -kMost, kMost));
}

using Tet = BisectionTet;

// Sets a shared number to the larger of it and `value`.
void raise(float& to, float value) {
  AtomicRef<float> shared(to);
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
    AtomicRef<std::uint64_t>(bits_).fetch_add(std::uint64_t(capped * kOne) << kCountBits | 1, std::memory_order_relaxed);
  }
  [[nodiscard]] double value() const { return bits_ == 0 ? 0 : double(bits_ >> kCountBits) / double(bits_ & ((1u << kCountBits) - 1)) / kOne; }

 private:
  static constexpr int kCountBits = 16, kOne = 1 << 20;
  std::uint64_t bits_ = 0;
};

// What is measured, as of SurfaceDeviation.
struct Found {
  std::span<float> largest, farthest;  // by update; farthest: empty if it is not wanted
  std::span<Mean> means;               // by supercube: deviations in its tetrahedra over the diamonds' width
  std::span<std::int64_t> removed;     // by update, in squares of the width of a diamond with h = 1, over kRemovedOne
};

// Takes the crossings of each cube down its bisection, and records how far each diamond's patches are from them.
template <class T>
class Descent {
 public:
  Descent(const Field<T>& field, const Isosurfaces& surfaces, const Grid& grid, const Domain& domain, const SupercubeSet& set, const Found& found)
      : field_(field),
        inverse_(grid.affine.inverse()),
        domain_(domain),
        set_(set),
        surfaces_(surfaces),
        finder_(field, surfaces_),
        measure_(field, grid.affine, domain),
        found_(found),
        width_(diamond_width(grid)) {
    if (surfaces_.count > 0) zero_ = surfaces_.surface[0].value;
    for (int k = 0; k < surfaces_.count; ++k) isovalue_[k] = float(surfaces_.surface[k].value - zero_);
  }

  // Everything inside one diamond of class 0.
  void measure(const Diamond& d) const {
    const Cube cube(d, field_.last);
    const CubeCrossings found = finder_.find(cube);
    const bool is_inside = domain_.is_interior(d);
    const double unknown = kUnknownDistance * width_ * double(d.h);
    for (std::size_t t = 0; t < kPaths.size(); ++t) {
      BySurface<std::span<const Crossing>> crossings;
      std::size_t count = 0;
      for (std::size_t k = 0; k < kMaxSurfaces; ++k) {
        crossings[k] = found[t][k];
        count += found[t][k].size();
      }
      if (count == 0) continue;
      const std::unique_ptr<Crossing[]> spare(new Crossing[count * std::size_t(3 * (d.scale + 1))]);  // not initialised
      Cursor cursor{{}, spare.get(), is_inside};
      descend<0>(tet_of(cube, kPaths[t]), crossings, {unknown, unknown}, cursor);
    }
  }

 private:
  template <class Value>
  using BySurface = std::array<Value, kMaxSurfaces>;
  // How far the next patch is, at most, from any point here, as far as coarser diamonds know.
  using Nearest = BySurface<double>;
  using Crossings = BySurface<std::span<const Crossing>>;  // in one tetrahedron

  // The supercube of a scale that was looked up last: the next diamond is mostly in it too.
  struct Near {
    Vertex position{-1, -1, -1};
    std::uint64_t occupancy = 0;
    SupercubeIndex supercube;
    UpdateIndex first;
  };
  // What one path of a cube needs on its way down.
  struct Cursor {
    std::array<Near, kTopScale + 1> near;  // by scale
    Crossing* spare;                       // room for the crossings of all levels that follow
    bool is_inside;                        // the cube lies in the box
  };

  [[nodiscard]] Tet tet_of(const Cube& cube, const std::array<int, 3>& path) const {
    Tet tet{{}, cube.scale, {}, {}};
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

  [[nodiscard]] std::optional<UpdateIndex> find(Vertex centre, int scale, Cursor& cursor) const {
    Near& here = cursor.near[std::size_t(scale)];
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
  [[nodiscard]] bool has_patch(const Tet& tet, Vertex centre, const Isosurface& surface) const {
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

  // What the interpolant in a tetrahedron misses a surface's value by, at the crossings of the field.
  struct Misses {
    double largest = 0, sum = 0, sum_of_squares = 0;
  };
  [[nodiscard]] static Misses misses(const Crossing& values, float isovalue, std::span<const Crossing> crossings) {
    Misses result;
    for (const Crossing& c : crossings) {
      const Crossing product = c * values;
      const double miss = double(std::abs(product[0] + product[1] + product[2] + product[3] - isovalue));
      result.largest = std::max(result.largest, miss);
      result.sum += miss;
      result.sum_of_squares += miss * miss;
    }
    return result;
  }

  // Records what the crossings in a tetrahedron say of its diamond, and narrows `nearest` where there is a patch. Returns
  // the sum of the squares of their deviations, in squares of width_.
  double record(const Tet& tet, Vertex centre, UpdateIndex update, const Crossings& crossings, Nearest& nearest, const Cursor& cursor) const {
    const Crossing values{tet.corner[0].value, tet.corner[1].value, tet.corner[2].value, tet.corner[3].value};
    const double width = width_ * double(1 << tet.scale);
    const bool is_moved =
        !cursor.is_inside && !std::all_of(tet.corner.begin(), tet.corner.end(), [&](const Tet::Corner& c) { return domain_.contains(c.at); });
    const double squared_slope = is_moved ? 0 : dot(tet.gradient, tet.gradient), slope = std::sqrt(squared_slope);
    double largest = 0, farthest = found_.farthest.empty() ? 0 : double(AtomicRef<float>(found_.farthest[update]).load(std::memory_order_relaxed)),
           sum = 0, sum_of_squares = 0;
    std::size_t all = 0;
    for (std::size_t k = 0; k < kMaxSurfaces; ++k) {
      if (crossings[k].empty()) continue;
      const Misses missed = misses(values, isovalue_[k], crossings[k]);
      const auto count = double(crossings[k].size());
      sum += missed.sum;
      all += crossings[k].size();
      if (is_moved || has_patch(tet, centre, surfaces_.surface[k])) {
        nearest[k] = width;
        if (!found_.farthest.empty())
          farthest = is_moved ? width : measure_.distance_to_patches(tet, centre, surfaces_.surface[k], zero_, crossings[k], farthest, width);
        largest = std::max(largest, missed.largest < width * slope ? missed.largest / slope : width);
        const double most = count * width * width;
        sum_of_squares += missed.sum_of_squares < most * squared_slope ? missed.sum_of_squares / squared_slope : most;
      } else {
        const double far = nearest[k] > kFarWidths * width ? nearest[k] : width;
        largest = std::max(largest, far);
        if (!found_.farthest.empty()) farthest = std::max(farthest, far);
        sum_of_squares += count * far * far;
      }
    }
    if (largest > kLeastDeviation * width_) raise(found_.largest[update], round_up(largest));
    if (farthest > kLeastDeviation * width_) raise(found_.farthest[update], round_up(farthest));
    if (!is_moved) found_.means[cursor.near[std::size_t(tet.scale)].supercube].add(sum / (double(all) * width * slope));
    return sum_of_squares / (width_ * width_);
  }

  // Returns what record() does. kClass: of the tetrahedron's diamond.
  template <int kClass>
  double descend(const Tet& tet, const Crossings& crossings, Nearest nearest, Cursor& cursor) const {
    const Vertex a = tet.corner[0].at, b = tet.corner[tail_of_class(kClass)].at;
    const Vertex centre{(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    const auto update = find(centre, tet.scale, cursor);
    if (!update) return 0;
    const double before = record(tet, centre, *update, crossings, nearest, cursor);
    double after = 0;
    if (tet.scale > 0 || kClass < 2) after = descend_into_halves<kClass>(tet, {centre, float(value(centre))}, crossings, nearest, cursor);
    AtomicRef<std::int64_t>(found_.removed[*update]).fetch_add(whole((before - after) * kRemovedOne), std::memory_order_relaxed);
    return before;
  }

  template <int kClass>
  double descend_into_halves(const Tet& tet, const Tet::Corner& middle, const Crossings& crossings, const Nearest& nearest, Cursor& cursor) const {
    constexpr int kFiner = finer_class(kClass);
    Crossing* const room = cursor.spare;
    Crossings first, second;
    for (std::size_t k = 0; k < kMaxSurfaces; ++k) {
      const auto [to, end] = std::array{cursor.spare, cursor.spare + crossings[k].size()};
      Crossing* const between = divide<kClass>(crossings[k], to);
      first[k] = {to, between};
      second[k] = {between, end};
      cursor.spare = end;
    }
    const auto is_empty = [](const Crossings& c) { return std::all_of(c.begin(), c.end(), [](const auto& of) { return of.empty(); }); };
    double sum = 0;
    if (!is_empty(first)) sum += descend<kFiner>(half_at_start<kClass>(tet, middle), first, nearest, cursor);
    if (!is_empty(second)) sum += descend<kFiner>(half_at_end<kClass>(tet, middle), second, nearest, cursor);
    cursor.spare = room;
    return sum;
  }

  // Writes the crossings of a tetrahedron with coordinates in its halves: of the half at the start from `to` on, and of
  // the other one behind. Returns where that begins.
  template <int kClass>
  static Crossing* divide(std::span<const Crossing> crossings, Crossing* to) {
    constexpr int kTail = tail_of_class(kClass);
    Crossing* end = to + crossings.size();
    for (const Crossing& c : crossings) {
      const float head = c[0], tail = c[kTail];
      Crossing half = c;
      if (head >= tail) {
        half[0] = head - tail;
        half[kTail] = 2 * tail;
        *to++ = half;
      } else {
        for (int i = 0; i + 1 < kTail; ++i) half[i] = c[i + 1];
        half[kTail - 1] = tail - head;
        half[kTail] = 2 * head;
        *--end = half;
      }
    }
    return to;
  }

  const Field<T>& field_;
  Affine inverse_;  // of the grid's map
  const Domain& domain_;
  const SupercubeSet& set_;
  Isosurfaces surfaces_;
  CrossingFinder<T> finder_;
  CrossingMeasure<T> measure_;
  Found found_;
  double width_;                 // of a diamond with h = 1
  BySurface<float> isovalue_{};  // counted from zero_
  double zero_ = 0;              // values in tetrahedra are counted from it, so that floats are precise enough
};

}  // namespace

SurfaceDeviation surface_deviation(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set, bool with_farthest,
                                   const ParallelFor& parallel) {
  SurfaceDeviation result{std::vector<float>(set.size(), 0), std::vector<float>(with_farthest ? set.size() : 0), std::vector<float>(set.supercubes()),
                          std::vector<double>(set.size()), 0};
  std::vector<std::int64_t> removed(set.size());
  std::vector<float>&largest = result.largest, &farthest = result.farthest;
  std::vector<Mean> means(set.supercubes());
  const int top = std::min(kTopScale, domain.levels() - 1);
  result.top_scale = top;
  const double width = diamond_width(volume.grid);
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain.last()};
    const Isosurfaces surfaces(range);
    const Descent<T> descent(field, surfaces, volume.grid, domain, set, {largest, farthest, means, removed});
    const PatchMeasure<T> patches(field, volume.grid.affine, domain);
    // Two surfaces in the wrong order are the ends of many (restored_field.h): the patches of one of these will do.
    const Isosurfaces one_of_each =
        range.alpha > range.beta ? Isosurfaces({std::midpoint(range.alpha, range.beta), std::numeric_limits<double>::infinity()}) : surfaces;
    std::vector<Diamond> cubes;  // shared out one by one: they are few, and bricks even fewer
    set.for_each(top, 0, [&](const Place& p) { cubes.emplace_back(set.centre(p)); });
    parallel(cubes.size(), [&](std::size_t i) { descent.measure(cubes[i]); });
    const auto at_least = [&](float& to, double distance) {
      if (distance > kLeastDeviation * width) to = std::max(to, round_up(distance));
    };
    parallel(set.bricks().size(), [&](std::size_t b) {
      const BrickIndex brick{std::uint32_t(b)};
      set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
        const int scale = scale_of_key(key);
        const Vertex position = position_of_key(key);
        UpdateIndex i = set.first(brick, s);
        for (const Slot slot : set_bits<Slot>(set.occupancy()[s])) {
          const Diamond d(centre_of(scale, position, slot), scale, kTypeOfSlot[slot]);
          const double tip = patches.at_spine(d, surfaces);
          at_least(largest[i], tip);
          if (with_farthest && scale <= top) {
            at_least(farthest[i], tip);
            at_least(farthest[i], patches.within_patches(d, one_of_each, std::max(double(farthest[i]), kLeastDeviation * width), width * d.h));
          }
          ++i;
        }
      });
    });
  });
  const Vec3 spacing = volume.grid.affine.spacing();
  const double unit = width / std::min({spacing[0], spacing[1], spacing[2]});
  for (UpdateIndex i{0}; i < set.size(); ++i) result.removed[i] = double(removed[i]) / kRemovedOne * unit * unit;
  for (int scale = top + 1; scale < domain.levels(); ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (BrickIndex b = begin; b < end; ++b)
      set.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) {
        largest[p.index] = round_up(width * double(1 << scale));
        if (with_farthest) farthest[p.index] = largest[p.index];
      });
  }
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(
        b, [&](SupercubeIndex s, SupercubeKey key) { result.mean[s] = float(means[s].value() * width * double(1 << scale_of_key(key))); });
  }
  return result;
}

}  // namespace intervale
