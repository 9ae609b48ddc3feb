#include "server/builder/surface_moves.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "common/ivm/interval_volume.h"
#include "common/util/bits.h"
#include "common/util/vec3.h"
#include "server/builder/interpolation_error.h"

namespace intervale {
namespace {

constexpr int kTopScale = 4;  // cubes of this scale are gone through one by one; coarser diamonds keep their width

// Of a top cube's width: so far from a surface in it is the next one, if no corner of it tells of one.
constexpr double kApart = kFurthest / (1 << kTopScale);
constexpr double kFar = 2.01;               // of a diamond's width: a patch that is further than this is far
constexpr double kLeast = 1e-4;             // of what the finest diamonds measure across: what moves less stays
constexpr double kNudge = 1.0 / (1 << 16);  // of a sample: so far into the box are points on its far sides taken to be

// A point where the field crosses a surface. Values in tetrahedra are counted from Cubes::zero_, so that floats will do.
struct Crossing {
  std::array<float, 4> at;  // barycentric coordinates
  int surface;              // which
};

struct Corner {
  Vertex at;
  float value;
};

// One tetrahedron of the bisection. Its spine goes from corner 0 to corner 3 - cls.
struct Tet {
  std::array<Corner, 4> corner;
  int scale, cls;
  std::array<Vec3, 4> weight;  // the gradients of the barycentric coordinates, in world units, which a step changes as it does those
  Vec3 gradient;               // of the interpolant
};

float round_up(double value) {
  const float f = float(std::min(value, double(std::numeric_limits<float>::max())));
  return double(f) < value ? std::nextafter(f, std::numeric_limits<float>::max()) : f;
}

// Not negative floats ascend like their bits.
void raise(float& to, float value) {
  std::atomic_ref<float> shared(to);
  float seen = shared.load(std::memory_order_relaxed);
  while (seen < value && !shared.compare_exchange_weak(seen, value, std::memory_order_relaxed)) {
  }
}

// Of shares of a width, each from 0 to 1; the same in whatever order they come.
class Mean {
 public:
  // Fewer than 2^16 times; from any thread.
  void add(double share) {
    const double most = share < 1 ? share : 1;
    std::atomic_ref<std::uint64_t>(bits_).fetch_add(std::uint64_t(most * (1 << 20)) << 16 | 1, std::memory_order_relaxed);
  }
  [[nodiscard]] double value() const { return bits_ == 0 ? 0 : double(bits_ >> 16) / double(bits_ & 0xffff) / (1 << 20); }

 private:
  std::uint64_t bits_ = 0;
};

template <class T>
class Cubes {
 public:
  Cubes(const Field<T>& field, const Range& range, const Grid& grid, const Domain& domain, const SupercubeSet& set, std::vector<float>& moves,
        std::vector<Mean>& means)
      : field_(field), grid_(grid), domain_(domain), set_(set), moves_(moves), means_(means), width_(diamond_width(grid)) {
    if (std::isfinite(range.alpha)) surface_[surfaces_++] = {range.alpha, false};
    if (std::isfinite(range.beta)) surface_[surfaces_++] = {range.beta, true};
    if (surfaces_ > 0) zero_ = surface_[0].value;
    for (int k = 0; k < surfaces_; ++k) kappa_[k] = float(surface_[k].value - zero_);
  }

  // All that is inside one diamond of class 0. crossings: room to work in.
  void measure(const Diamond& cube, std::vector<Crossing>& crossings) const {
    std::array<std::vector<Crossing>, 6> of_tet;
    NearByScale near;
    near.inside = domain_.is_interior(cube);
    const Vertex from{cube.centre.x - cube.h, cube.centre.y - cube.h, cube.centre.z - cube.h};
    const Vertex last = field_.last;
    const std::int32_t side = 2 * cube.h;
    const std::array<std::ptrdiff_t, 3> step{1, last.x + 1, std::ptrdiff_t(last.x + 1) * (last.y + 1)};
    const Vertex begin{std::max(0, from.x), std::max(0, from.y), std::max(0, from.z)};
    const Vertex end{std::min(last.x, from.x + side), std::min(last.y, from.y + side), std::min(last.z, from.z + side)};
    // What lies in a far side of the box belongs to the tetrahedra before it, not to those behind, which clamping makes flat.
    const std::array<std::int32_t, 3> low{from.x, from.y, from.z};
    const std::array<double, 3> most{last.x - from.x - kNudge, last.y - from.y - kNudge, last.z - from.z - kNudge};
    const Vertex start = cube.vertex(0);  // of the spine
    const std::array<bool, 3> flip{start.x != from.x, start.y != from.y, start.z != from.z};
    for (std::int32_t z = begin.z; z <= end.z; ++z) {
      for (std::int32_t y = begin.y; y <= end.y; ++y) {
        const T* const row = &field_.samples[field_.index({0, y, z})];
        for (std::int32_t x = begin.x; x <= end.x; ++x) {
          // The finest tetrahedra's edges: along one, two or three axes, from where those coordinates are even to where they are odd.
          const std::array<std::int32_t, 3> v{x, y, z};
          if (x < end.x && y < end.y && z < end.z && !is_crossed(row + x, step)) continue;
          for (unsigned axes = 1; axes < 8; ++axes) {
            if (((axes & 1) != 0 && x == end.x) || ((axes & 2) != 0 && y == end.y) || ((axes & 4) != 0 && z == end.z)) continue;
            std::array<double, 3> even{}, odd{};  // from v
            const T *first = row + x, *second = row + x;
            for (int i = 0; i < 3; ++i) {
              if ((axes >> i & 1) == 0) continue;
              const bool back = (v[i] & 1) != 0;
              (back ? even : odd)[i] = 1;
              (back ? first : second) += step[i];
            }
            const double a = double(*first), b = double(*second);
            for (int k = 0; k < surfaces_; ++k) {
              const double surface = surface_[k].value;
              if (!differ(a, b, surface_[k])) continue;
              const double t = (surface - a) / (b - a);
              std::array<double, 3> p;
              for (int i = 0; i < 3; ++i) {
                p[i] = std::min(v[i] - low[i] + even[i] + t * (odd[i] - even[i]), most[i]);
                p[i] = (flip[i] ? side - p[i] : p[i]) / side;
              }
              add(p, k, of_tet);
            }
          }
        }
      }
    }
    for (int t = 0; t < 6; ++t) {
      if (of_tet[t].empty()) continue;
      Tet tet{{}, cube.scale, 0, {}, {}};
      Vertex v = start;
      tet.corner[0] = {v, float(value(v))};
      tet.weight[0] = {};
      for (int i = 0; i < 3; ++i) {
        const int axis = kPaths[t][i];
        std::int32_t& c = axis == 0 ? v.x : axis == 1 ? v.y : v.z;
        c += flip[axis] ? -side : side;
        tet.corner[i + 1] = {v, float(value(v))};
        const double inverse = (flip[axis] ? -1 : 1) / (side * grid_.spacing[axis]);
        tet.weight[i][axis] -= inverse;
        tet.weight[i + 1] = {};
        tet.weight[i + 1][axis] = inverse;
        tet.gradient[axis] = (double(tet.corner[i + 1].value) - double(tet.corner[i].value)) * inverse;
      }
      crossings = std::move(of_tet[t]);
      const double unknown = kApart * width_ * double(cube.h);
      descend(tet, crossings, {unknown, unknown}, near);
    }
  }

  // From where a patch cuts a diamond's spine to where the field crosses that nearest by, in world units.
  [[nodiscard]] double measure_tip(const Diamond& d) const {
    const Vertex a = d.vertex(0), b = d.vertex(1);
    if (!domain_.contains(a) || !domain_.contains(b)) return 0;
    const Vertex step{(b.x - a.x) / (2 * d.h), (b.y - a.y) / (2 * d.h), (b.z - a.z) / (2 * d.h)};
    const T* const samples = &field_.samples[field_.index(a)];
    const std::ptrdiff_t stride = &field_.samples[field_.index({a.x + step.x, a.y + step.y, a.z + step.z})] - samples;
    const int steps = 2 * d.h;
    double far = 0;
    for (int k = 0; k < surfaces_; ++k) {
      const double kappa = surface_[k].value, first = double(samples[0]), last = double(samples[steps * stride]);
      if (!differ(first, last, surface_[k])) continue;
      const double cut = steps * (kappa - first) / (last - first);
      double nearest = steps;
      for (int i = 0; i < steps; ++i) {
        const double u = double(samples[i * stride]), w = double(samples[(i + 1) * stride]);
        if (differ(u, w, surface_[k])) nearest = std::min(nearest, std::abs(i + (kappa - u) / (w - u) - cut));
      }
      far = std::max(far, nearest);
    }
    return far * std::hypot(grid_.spacing[0] * step.x, grid_.spacing[1] * step.y, grid_.spacing[2] * step.z);
  }

 private:
  struct CutAt {
    double value;
    bool is_beta;
  };
  // As the sides of samples tell (range.h): one equal to alpha or beta is inside.
  [[nodiscard]] static bool differ(double a, double b, const CutAt& cut) {
    return cut.is_beta ? (a > cut.value) != (b > cut.value) : (a < cut.value) != (b < cut.value);
  }
  // Whether a cell's eight samples, from one on, lie on different sides of a surface.
  [[nodiscard]] bool is_crossed(const T* sample, const std::array<std::ptrdiff_t, 3>& step) const {
    T least = *sample, most = *sample;
    for (unsigned corner = 1; corner < 8; ++corner) {
      const T value = sample[(corner & 1 ? step[0] : 0) + (corner & 2 ? step[1] : 0) + (corner & 4 ? step[2] : 0)];
      least = std::min(least, value);
      most = std::max(most, value);
    }
    for (int k = 0; k < surfaces_; ++k) {
      if (differ(double(least), double(most), surface_[k])) return true;
    }
    return false;
  }

  static constexpr std::array<std::array<int, 3>, 6> kPaths{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

  // The tetrahedra of a cube are those of the paths along its edges from one end of the spine to the other.
  static void add(const std::array<double, 3>& p, int surface, std::array<std::vector<Crossing>, 6>& of_tet) {
    for (int t = 0; t < 6; ++t) {
      const double x = p[kPaths[t][0]], y = p[kPaths[t][1]], z = p[kPaths[t][2]];
      if (x < y || y < z) continue;
      of_tet[t].push_back({{float(1 - x), float(x - y), float(y - z), float(z)}, surface});
      return;
    }
  }

  [[nodiscard]] double value(Vertex v) const { return field_.at(domain_.clamp(v)) - zero_; }

  // The supercube of each scale that was looked into last: the next diamond is mostly in it too.
  struct Near {
    Vertex position{-1, -1, -1};
    std::uint64_t occupancy = 0;
    std::uint32_t supercube = 0;
    UpdateIndex first = 0;
  };
  struct NearByScale : std::array<Near, kTopScale + 1> {
    bool inside = false;  // the cube that is gone through is in the box
  };

  [[nodiscard]] std::optional<UpdateIndex> find(Vertex centre, int scale, NearByScale& near) const {
    Near& here = near[std::size_t(scale)];
    const Vertex position{centre.x >> (scale + 2), centre.y >> (scale + 2), centre.z >> (scale + 2)};
    if (here.position != position) {
      const auto found = set_.find_supercube(scale, position);
      here = found ? Near{position, set_.occupancy()[found->supercube], found->supercube, set_.first(found->brick, found->supercube)}
                   : Near{position, 0, 0, 0};
    }
    const int slot = kSlotOfType[type_of(centre, scale)];
    if (!(here.occupancy >> slot & 1)) return {};
    return here.first + UpdateIndex(count_below(here.occupancy, slot));
  }

  // Whether there is a patch of that surface in the tetrahedron, or at least in its diamond.
  [[nodiscard]] bool has_patch(const Tet& tet, Vertex centre, const CutAt& surface) const {
    const double first = tet.corner[0].value + zero_;
    for (int i = 1; i < 4; ++i) {
      if (differ(first, tet.corner[i].value + zero_, surface)) return true;
    }
    const Diamond diamond(centre);
    for (int i = 0; i < diamond.row->vertices; ++i) {
      if (differ(first, value(diamond.vertex(i)) + zero_, surface)) return true;
    }
    return false;
  }

  // nearest: of each surface, how far the next patch is from any point here at most; what diamonds above could tell.
  void descend(const Tet& tet, std::span<Crossing> crossings, std::array<double, 2> nearest, NearByScale& near) const {
    const int tail = 3 - tet.cls;
    const Vertex a = tet.corner[0].at, b = tet.corner[tail].at;
    const Vertex centre{(a.x + b.x) / 2, (a.y + b.y) / 2, (a.z + b.z) / 2};
    const auto update = find(centre, tet.scale, near);
    if (!update) return;
    const std::array<float, 4> values{tet.corner[0].value, tet.corner[1].value, tet.corner[2].value, tet.corner[3].value};
    double alpha_off = -1, beta_off = -1, sum = 0;  // -1: none
    for (const Crossing& c : crossings) {
      float at = 0;
      for (int i = 0; i < 4; ++i) at += c.at[i] * values[i];
      const double here = std::abs(at - kappa_[c.surface]);
      alpha_off = std::max(alpha_off, c.surface == 0 ? here : -1.0);
      beta_off = std::max(beta_off, c.surface == 0 ? -1.0 : here);
      sum += here;
    }
    const double most = width_ * double(1 << tet.scale);
    const bool is_moved = !near.inside && !std::all_of(tet.corner.begin(), tet.corner.end(), [&](const Corner& c) { return domain_.contains(c.at); });
    const double slope = is_moved ? 0 : std::sqrt(dot(tet.gradient, tet.gradient));
    const std::array<double, 2> off{alpha_off, beta_off};
    double move = 0;
    for (int k = 0; k < surfaces_; ++k) {
      if (off[k] < 0) continue;
      if (is_moved || has_patch(tet, centre, surface_[k])) {
        nearest[k] = most;
        move = std::max(move, off[k] < most * slope ? off[k] / slope : most);
      } else {
        move = std::max(move, nearest[k] > kFar * most ? nearest[k] : most);
      }
    }
    if (move > kLeast * width_) raise(moves_[*update], round_up(move));
    if (!is_moved) means_[near[std::size_t(tet.scale)].supercube].add(sum / double(crossings.size()) / (most * slope));
    if (tet.scale == 0 && tet.cls == 2) return;
    const auto nearer_tail = std::partition(crossings.begin(), crossings.end(), [tail](const Crossing& c) { return c.at[0] >= c.at[tail]; });
    const auto split = std::size_t(nearer_tail - crossings.begin());
    const Corner middle{centre, float(value(centre))};
    const int scale = tet.cls == 2 ? tet.scale - 1 : tet.scale, cls = tet.cls == 2 ? 0 : tet.cls + 1;
    const double bend = double(middle.value) - 0.5 * (double(tet.corner[0].value) + double(tet.corner[tail].value));
    if (split > 0) {
      Tet child = tet;
      child.scale = scale;
      child.cls = cls;
      child.corner[tail] = middle;
      for (int k = 0; k < 3; ++k) {
        child.weight[0][k] -= tet.weight[tail][k];
        child.weight[tail][k] *= 2;
        child.gradient[k] += bend * child.weight[tail][k];
      }
      for (Crossing& c : crossings.first(split)) {
        c.at[0] -= c.at[tail];
        c.at[tail] *= 2;
      }
      descend(child, crossings.first(split), nearest, near);
    }
    if (split < crossings.size()) {
      Tet child = tet;
      child.scale = scale;
      child.cls = cls;
      for (int i = 0; i < tail; ++i) {
        child.corner[i] = tet.corner[i + 1];
        child.weight[i] = tet.weight[i + 1];
      }
      child.corner[tail] = middle;
      for (int k = 0; k < 3; ++k) {
        child.weight[tail - 1][k] -= tet.weight[0][k];
        child.weight[tail][k] = 2 * tet.weight[0][k];
        child.gradient[k] += bend * child.weight[tail][k];
      }
      for (Crossing& c : crossings.subspan(split)) {
        const float head = c.at[0];
        const float rest = c.at[tail] - head;
        for (int i = 0; i + 1 < tail; ++i) c.at[i] = c.at[i + 1];
        c.at[tail - 1] = rest;
        c.at[tail] = 2 * head;
      }
      descend(child, crossings.subspan(split), nearest, near);
    }
  }

  const Field<T>& field_;
  const Grid& grid_;
  const Domain& domain_;
  const SupercubeSet& set_;
  std::vector<float>& moves_;  // by update
  std::vector<Mean>& means_;   // by supercube: of its tetrahedra
  double width_;
  std::array<CutAt, 2> surface_{};
  std::array<float, 2> kappa_{};  // counted from zero_
  int surfaces_ = 0;
  double zero_ = 0;
};

}  // namespace

SurfaceMoves surface_moves(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set) {
  std::vector<float> moves(set.size(), 0);
  std::vector<Mean> means(set.supercubes());
  const int top = std::min(kTopScale, domain.levels() - 1);
  const double width = diamond_width(volume.grid);
  visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain.last()};
    const Cubes<T> cubes(field, range, volume.grid, domain, set, moves, means);
    std::vector<Diamond> all;  // few, and even fewer bricks
    set.for_each(top, 0, [&](const Place& p) { all.emplace_back(set.centre(p)); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, all.size(), 1), [&](const auto& some) {
      std::vector<Crossing> crossings;
      for (std::size_t i = some.begin(); i < some.end(); ++i) cubes.measure(all[i], crossings);
    });
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(set.bricks().size()), [&](std::uint32_t b) {
      set.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) {
        const double tip = cubes.measure_tip(Diamond(SupercubeSet::centre(p), scale_of_key(p.key), kTypeOfSlot[p.slot]));
        if (tip > kLeast * width) moves[p.index] = std::max(moves[p.index], round_up(tip));
      });
    });
  });
  for (int scale = top + 1; scale < domain.levels(); ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (std::uint32_t b = begin; b < end; ++b)
      set.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) { moves[p.index] = round_up(width * double(1 << scale)); });
  }
  std::vector<float> mean(set.supercubes());
  for (std::uint32_t b = 0; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](std::uint32_t s, SupercubeKey key) { mean[s] = float(means[s].value() * width * double(1 << scale_of_key(key))); });
  }
  return {std::move(moves), std::move(mean)};
}

}  // namespace intervale
