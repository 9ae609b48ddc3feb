#include "server/build/field_hierarchy.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <mutex>

#include "common/tet_cases.h"
#include "server/build/error_levels.h"
#include "server/build/interpolation_error.h"

namespace intervale {
namespace {

// All diamonds of one scale with a place in or across the box, one bit each, by supercubes in a dense grid.
struct Level {
  int scale = 0;
  std::array<std::int32_t, 3> dims{};  // in supercubes
  std::vector<std::uint64_t> words;

  Level(int s, Vertex last) : scale(s) {
    const auto supercubes = [s](std::int32_t n) { return std::int32_t((((std::int64_t(n) + (1 << s) - 1) >> s) >> 2) + 1); };
    dims = {supercubes(last.x), supercubes(last.y), supercubes(last.z)};
    words.resize(std::size_t(dims[0]) * std::size_t(dims[1]) * std::size_t(dims[2]));
  }
  [[nodiscard]] Vertex position(std::size_t i) const {
    return {std::int32_t(i % dims[0]), std::int32_t(i / dims[0] % dims[1]), std::int32_t(i / (std::size_t(dims[0]) * dims[1]))};
  }
  // Bits of a pass are read while others of the same word are written: atomic, and nothing more.
  [[nodiscard]] bool contains(const Diamond& d) const {
    const int up = scale + 2;
    if ((d.centre.x | d.centre.y | d.centre.z) < 0) return false;
    const std::int32_t x = d.centre.x >> up, y = d.centre.y >> up, z = d.centre.z >> up;
    if (x >= dims[0] || y >= dims[1] || z >= dims[2]) return false;
    const std::size_t i = (std::size_t(z) * dims[1] + y) * dims[0] + x;
    return std::atomic_ref(const_cast<std::uint64_t&>(words[i])).load(std::memory_order_relaxed) >> kSlotOfType[d.type] & 1;
  }
  void insert(std::size_t i, std::uint64_t slots) {
    std::atomic_ref word(words[i]);
    word.store(word.load(std::memory_order_relaxed) | slots, std::memory_order_relaxed);
  }
};

// Whether sides, as a set of bits 1 << side, call for an update.
bool counts(unsigned sides, Refine refine) {
  if (refine == Refine::uniform) return (sides & 2) != 0 || sides == 5;
  return (sides & (sides - 1)) != 0;
}

template <class T>
unsigned sides_around(const Field<T>& field, const Domain& domain, const Range& range, const Diamond& d, unsigned tets, bool interior) {
  const auto bit = [&range](double value) { return 1u << unsigned(side_of(value, range)); };
  if (interior) {
    const T* const centre = &field.samples[field.index(d.centre)];
    const std::ptrdiff_t y = (field.last.x + 1) * std::ptrdiff_t(d.h), z = y * (field.last.y + 1);
    unsigned sides = bit(double(*centre));
    for (int v = 0; v < d.row->vertices; ++v) {
      const Offset f = d.row->vertex[v];
      sides |= bit(double(centre[f.x * std::ptrdiff_t(d.h) + f.y * y + f.z * z]));
    }
    return sides;
  }
  const unsigned vertices = Domain::vertices(*d.row, tets);
  unsigned sides = bit(field.at(domain.clamp(d.centre)));
  for (int v = 0; v < d.row->vertices; ++v) {
    if (vertices >> v & 1) sides |= bit(field.at(domain.clamp(d.vertex(v))));
  }
  return sides;
}

template <class T>
DiamondContext context_of(const Field<T>& field, const Domain& domain, const Range& range, const Diamond& d) {
  DiamondContext c;
  c.row = d.row;
  const bool interior = domain.is_interior(d);
  const unsigned tets = interior ? (1u << d.row->tets) - 1 : domain.tets(d);
  c.vertices = interior ? (1u << d.row->vertices) - 1 : Domain::vertices(*d.row, tets);
  const unsigned edges = interior ? (1u << d.row->edges) - 1 : Domain::edges(*d.row, tets);
  std::array<double, kMaxVertices> f{};
  for (int v = 0; v < d.row->vertices; ++v) {
    if (!c.has(v)) continue;
    f[v] = field.at(domain.clamp(d.vertex(v)));
    c.sides |= std::uint32_t(side_of(f[v], range)) << (2 * v);
  }
  for (int e = 0; e < d.row->edges; ++e) {
    const auto [a, b] = edge_ends(e, d.row->belt);
    if (c.side(a) == c.side(b) || !(edges >> e & 1)) continue;
    const Cuts cuts = cuts_between(f[a], f[b], range);
    int n = 0;
    if (alpha_cuts(c.side(a), c.side(b))) c.cut[e][0] = std::uint16_t(2 * cuts.q[n++] + 1);
    if (beta_cuts(c.side(a), c.side(b))) c.cut[e][1] = std::uint16_t(2 * cuts.q[n] + 1);
  }
  return c;
}

// The cuts on the subdivision edges; comes back with how many.
template <class T>
std::size_t cuts_of(const Field<T>& field, const Domain& domain, const Range& range, const Diamond& d, const DiamondContext& c, std::uint8_t* cuts) {
  const double centre = field.at(domain.clamp(d.centre));
  std::size_t n = 0;
  for (int v = 0; v < d.row->vertices; ++v) {
    if (!c.has(v)) continue;
    const double value = field.at(domain.clamp(d.vertex(v)));
    if (side_of(value, range) == side_of(centre, range)) continue;
    const Cuts q = cuts_between(centre, value, range);
    for (int i = 0; i < q.count; ++i) cuts[n++] = q.q[i];
  }
  return n;
}

float round_up(double error) {
  if (error >= std::numeric_limits<float>::max()) return std::numeric_limits<float>::max();
  const float f = float(error);
  return f < error ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace

FieldHierarchy::FieldHierarchy(const Volume& volume, const BuildOptions& options)
    : volume_(volume), range_(options.range), refine_(options.refine), domain_(volume.grid.dims) {
  find_relevant();
  measure_errors(options.progress);
}

void FieldHierarchy::find_relevant() {
  std::vector<Level> levels;
  for (int scale = 0; scale < domain_.levels(); ++scale) levels.emplace_back(scale, domain_.last());
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    // From fine to coarse: children are known before their parents.
    for (Level& level : levels) {
      for (int cls = 2; cls >= 0; --cls) {
        const bool has_children = cls != 2 || level.scale > 0;
        const Level* const below = cls == 2 ? (has_children ? &levels[level.scale - 1] : nullptr) : &level;
        tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.words.size(), 64), [&](const auto& some) {
          for (std::size_t i = some.begin(); i != some.end(); ++i) {
            const SupercubeKey key = supercube_key(level.scale, level.position(i));
            std::uint64_t slots = 0;
            for (std::uint64_t left = kSlotsOfClass[cls]; left != 0; left &= left - 1) {
              const int slot = std::countr_zero(left);
              const Diamond d(centre_of(key, slot));
              const bool interior = domain_.is_interior(d);
              const unsigned tets = interior ? 1 : domain_.tets(d);
              if (tets == 0 || (!interior && domain_.is_idle(d))) continue;
              bool relevant = counts(sides_around(field, domain_, range_, d, tets, interior), refine_);
              for (int k = 0; k < d.row->children && has_children && !relevant; ++k) relevant = below->contains(Diamond(d.child(k)));
              if (relevant) slots |= std::uint64_t(1) << slot;
            }
            if (slots != 0) level.insert(i, slots);
          }
        });
      }
    }
  });
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
    std::vector<std::pair<SupercubeKey, std::uint64_t>> full;
    for (std::size_t i = 0; i < level->words.size(); ++i) {
      if (level->words[i] != 0) full.emplace_back(supercube_key(level->scale, level->position(i)), level->words[i]);
    }
    std::sort(full.begin(), full.end());
    for (const auto& [key, word] : full) {
      keys.push_back(key);
      occupancy.push_back(word);
    }
    level->words = {};
  }
  set_ = SupercubeSet(keys, std::move(occupancy));
}

void FieldHierarchy::measure_errors(const std::function<void(double)>& progress) {
  errors_.assign(set_.size(), 0);
  std::mutex telling;
  double told = 0;
  std::atomic<std::uint64_t> done = 0;
  // Every class of every scale goes over the whole box once, at most: that share of the work is done.
  const double steps = 3.0 * domain_.levels();
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    for (int scale = 0; scale < domain_.levels(); ++scale) {
      const auto [begin, end] = set_.of_scale(scale);
      for (int cls = 2; cls >= 0; --cls) {
        tbb::parallel_for(tbb::blocked_range<std::uint32_t>(begin, end, 1), [&](const auto& some) {
          for (std::uint32_t brick = some.begin(); brick != some.end(); ++brick) {
            set_.for_each_in_brick(brick, kSlotsOfClass[cls], [&](const Place& p) {
              const Diamond d(set_.centre(p));
              const unsigned tets = domain_.tets(d);
              double error = 0;
              if (scale < 5) {
                error = diamond_error(field, domain_, d, tets);
              } else {  // few and large: share out the tetrahedra
                error = tbb::parallel_reduce(
                    tbb::blocked_range<int>(0, d.row->tets, 1), 0.0,
                    [&](const auto& range, double worst) {
                      for (int i = range.begin(); i != range.end(); ++i)
                        worst = std::max(worst, tets >> i & 1 ? diamond_error(field, domain_, d, 1u << i) : 0.0);
                      return worst;
                    },
                    [](double a, double b) { return std::max(a, b); });
              }
              float saturated = round_up(error);
              for (int k = 0; k < d.row->children && d.has_children(); ++k) {
                const Vertex c = d.child(k);
                if ((c.x | c.y | c.z) < 0) continue;
                if (const auto child = set_.find(c)) saturated = std::max(saturated, errors_[child->index]);
              }
              errors_[p.index] = saturated;
            });
          }
        });
        ++done;
        if (progress) {
          const std::scoped_lock lock(telling);
          told = std::max(told, double(done) / steps);
          progress(told);
        }
      }
    }
  });
}

double FieldHierarchy::value(Vertex v) const {
  return visit_samples(volume_, [&]<class T>(std::span<const T> samples) { return Field<T>{samples, domain_.last()}.at(domain_.clamp(v)); });
}

Side FieldHierarchy::side(Vertex v) const { return side_of(value(v), range_); }

Base FieldHierarchy::base() const {
  const Diamond root(domain_.root());
  const unsigned edges = Domain::edges(*root.row, domain_.tets(root));
  Base base;
  for (int v = 0; v < kRootVertices; ++v) base.side[v] = side(root.vertex(v));
  for (int e = 0; e < kRootEdges; ++e) {
    const auto [a, b] = edge_ends(e, root.row->belt);
    if (edges >> e & 1) base.cuts[e] = cuts_between(value(root.vertex(a)), value(root.vertex(b)), range_);
  }
  return base;
}

DiamondContext FieldHierarchy::context(const Diamond& d) const {
  return visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    return context_of(Field<T>{samples, domain_.last()}, domain_, range_, d);
  });
}

std::vector<std::uint8_t> FieldHierarchy::cuts(const Diamond& d) const {
  std::vector<std::uint8_t> cuts(kMaxCuts);
  const DiamondContext c = context(d);
  cuts.resize(visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    return cuts_of(Field<T>{samples, domain_.last()}, domain_, range_, d, c, cuts.data());
  }));
  return cuts;
}

// Leaves of the full mesh: the halves that split diamonds leave to children that are never split. Its vertices are cuts of unit edges, for every
// longer edge with different sides is the spine of a relevant diamond, and samples inside the range that are centres.
FullMesh FieldHierarchy::full_mesh() const {
  const TetCases& cases = tet_cases();
  const auto leaves = [&](const Diamond& d, bool is_split) {
    std::uint64_t n = 0;
    std::uint32_t sides = 0;
    for (int v = 0; v < d.row->vertices; ++v) sides |= std::uint32_t(side(d.vertex(v))) << (2 * v);
    sides |= std::uint32_t(side(d.centre)) << (2 * kCentre);
    const bool interior = domain_.is_interior(d);
    const auto add = [&](std::array<std::uint8_t, 4> local, const TetShape& known) {
      if (interior) {
        n += cases.count(known.order, shape_sides(known, sides));
        return;
      }
      const auto positions = domain_.positions(d, local);
      if (!Domain::exists(positions)) return;
      const TetShape s = shape_of(positions, local, d.row->belt);
      n += cases.count(s.order, shape_sides(s, sides));
    };
    const unsigned tets = domain_.tets(d);
    if (!is_split) {
      for (int i = 0; i < d.row->tets; ++i) {
        if (tets >> i & 1) add(d.row->tet(i), d.row->shape[i]);
      }
      return n;
    }
    for (int k = 0; k < d.row->children; ++k) {
      if (d.has_children()) {
        const Vertex c = d.child(k);
        if ((c.x | c.y | c.z) >= 0 && set_.find(c)) continue;
      }
      for (const Duet::Half& half : d.row->child[k].half) {
        if (!(tets >> half.tet & 1)) continue;
        auto local = d.row->tet(half.tet);
        local[1 - half.end] = kCentre;
        add(local, d.row->half_shape[half.tet][half.end]);
      }
    }
    return n;
  };

  FullMesh full;
  if (set_.size() == 0) full.tets = leaves(Diamond(domain_.root()), false);
  full.tets += tbb::parallel_reduce(
      tbb::blocked_range<std::uint32_t>(0, std::uint32_t(set_.bricks().size()), 1), std::uint64_t(0),
      [&](const auto& some, std::uint64_t n) {
        for (std::uint32_t b = some.begin(); b != some.end(); ++b) {
          set_.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) { n += leaves(Diamond(set_.centre(p)), true); });
        }
        return n;
      },
      std::plus<>());

  const Vertex last = domain_.last();
  full.vertices = visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, last};
    const auto even = [](std::int32_t i) { return i + (i & 1); };
    return tbb::parallel_reduce(
        tbb::blocked_range<std::int32_t>(0, last.z + 1), std::uint64_t(0),
        [&](const auto& slices, std::uint64_t n) {
          for (std::int32_t z = slices.begin(); z != slices.end(); ++z) {
            for (std::int32_t y = 0; y <= last.y; ++y) {
              for (std::int32_t x = 0; x <= last.x; ++x) {
                const auto at = [&](std::int32_t i, std::int32_t j, std::int32_t k) { return side_of(field.at({i, j, k}), range_); };
                const bool in_x = x < last.x, in_y = y < last.y, in_z = z < last.z;
                const Side here = at(x, y, z);
                const std::int32_t ex = even(x), ey = even(y), ez = even(z), ox = 2 * x + 1 - ex, oy = 2 * y + 1 - ey, oz = 2 * z + 1 - ez;
                if (in_x) n += cut_count(here, at(x + 1, y, z));
                if (in_y) n += cut_count(here, at(x, y + 1, z));
                if (in_z) n += cut_count(here, at(x, y, z + 1));
                if (in_x && in_y) n += cut_count(at(ex, ey, z), at(ox, oy, z));
                if (in_x && in_z) n += cut_count(at(ex, y, ez), at(ox, y, oz));
                if (in_y && in_z) n += cut_count(at(x, ey, ez), at(x, oy, oz));
                if (in_x && in_y && in_z) n += cut_count(at(ex, ey, ez), at(ox, oy, oz));
              }
            }
          }
          return n;
        },
        std::plus<>());
  });
  std::vector<bool> inside(volume_.grid.sample_count());
  const auto mark = [&](Vertex v) {
    const Vertex c = domain_.clamp(v);
    if (side(c) == Side::inside) inside[Field<char>{{}, last}.index(c)] = true;
  };
  const Diamond root(domain_.root());
  for (int v = 0; v < kRootVertices; ++v) mark(root.vertex(v));
  set_.for_each_down([&](const Place& p) { mark(set_.centre(p)); });
  full.vertices += std::uint64_t(std::count(inside.begin(), inside.end(), true));
  return full;
}

Result<IntervalVolume> FieldHierarchy::compact() const {
  IntervalVolume::Parts parts;
  Description& d = parts.description;
  d.name = volume_.name;
  d.grid = volume_.grid;
  d.range = range_;
  d.refine = refine_;
  d.full = full_mesh();
  d.base = encode_base(base());
  parts.set = set_;
  parts.error_levels = choose_error_levels(errors_, kErrorLevels);
  d.max_error = parts.error_levels.empty() ? 0.0 : double(parts.error_levels.back());
  parts.codes.resize(set_.size());
  // Each brick's differences by themselves; then all in one.
  std::vector<std::vector<std::uint8_t>> differences(set_.bricks().size());
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(differences.size()), [&](std::uint32_t b) {
      set_.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) {
        const Diamond diamond(set_.centre(p));
        const Side centre = side_of(field.at(domain_.clamp(diamond.centre)), range_);
        const DiamondContext c = context_of(field, domain_, range_, diamond);
        std::array<std::uint8_t, kMaxCuts> cuts, coded;
        const std::size_t n = cuts_of(field, domain_, range_, diamond, c, cuts.data());
        Prediction prediction(c);
        prediction.encode(centre, std::span(cuts).first(n), coded.data());
        differences[b].insert(differences[b].end(), coded.begin(), coded.begin() + std::ptrdiff_t(n));
        const auto level = std::lower_bound(parts.error_levels.begin(), parts.error_levels.end(), errors_[p.index]) - parts.error_levels.begin();
        parts.codes[p.index] =
            UpdateCode((unsigned(centre) + 3 - unsigned(prediction.side())) % 3, unsigned(n), unsigned(c.count_cuts(centre).first), unsigned(level));
      });
    });
  });
  std::size_t total = 0;
  for (const auto& part : differences) total += part.size();
  parts.differences.reserve(total);
  for (auto& part : differences) {
    parts.differences.insert(parts.differences.end(), part.begin(), part.end());
    part = {};
  }
  return IntervalVolume::assemble(std::move(parts));
}

}  // namespace intervale
