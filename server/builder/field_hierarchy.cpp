#include "server/builder/field_hierarchy.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <tuple>

#include "common/diamond/supercube_neighbours.h"
#include "common/patch/tet_cases.h"
#include "common/util/bits.h"
#include "server/builder/error_levels.h"
#include "server/builder/interpolation_error.h"
#include "server/builder/relevance.h"
#include "server/builder/supercube_family.h"
#include "server/builder/surface_moves.h"

namespace intervale {
namespace {

constexpr int kShared = 5;  // diamonds of this scale and up are few and large: threads share their tetrahedra out

// The samples around a diamond, by local vertex.
using Around = std::array<double, kMaxVertices + 1>;

template <class T>
Around around(const Field<T>& field, const Domain& domain, const Diamond& d, const Outline& outline) {
  Around f{};
  if (outline.interior) {
    const T* const centre = &field.samples[field.index(d.centre)];
    const std::ptrdiff_t x = d.h, y = x * (field.last.x + 1), z = y * (field.last.y + 1);
    for (int v = 0; v < d.row->vertices; ++v) {
      const Offset at = d.row->vertex[v];
      f[v] = double(centre[at.x * x + at.y * y + at.z * z]);
    }
    f[kCentre] = double(*centre);
    return f;
  }
  for (int v = 0; v < d.row->vertices; ++v) {
    if (outline.vertices >> v & 1) f[v] = field.at(domain.clamp(d.vertex(v)));
  }
  f[kCentre] = field.at(domain.clamp(d.centre));
  return f;
}

// Of each class: the ends of each edge, and the edges at each vertex, a bit each.
struct EdgeTable {
  std::array<std::array<std::uint8_t, 2>, kMaxEdges> ends{};
  std::array<std::uint32_t, kMaxVertices> at{};
};
constexpr std::array<EdgeTable, 3> kEdgeTables = [] {
  std::array<EdgeTable, 3> tables{};
  constexpr int belts[3] = {6, 4, 8};
  for (int cls = 0; cls < 3; ++cls) {
    for (int e = 0; e < 1 + 3 * belts[cls]; ++e) {
      const auto [a, b] = edge_ends(e, belts[cls]);
      tables[cls].ends[e] = {std::uint8_t(a), std::uint8_t(b)};
      tables[cls].at[a] |= 1u << e;
      tables[cls].at[b] |= 1u << e;
    }
  }
  return tables;
}();

DiamondContext context_of(const Around& f, const Outline& outline, const Range& range) {
  DiamondContext c;
  c.row = outline.row;
  c.vertices = outline.vertices;
  const EdgeTable& edges = kEdgeTables[c.row->cls];
  std::uint32_t alpha = 0, beta = 0;  // the edges that they cut: one end is below, or above, and the other is not
  for (int v = 0; v < c.row->vertices; ++v) {
    if (!c.has(v)) continue;
    const Side side = side_of(f[v], range);
    c.sides |= std::uint32_t(side) << (2 * v);
    alpha ^= side == Side::below ? edges.at[v] : 0;
    beta ^= side == Side::above ? edges.at[v] : 0;
  }
  for (const int e : set_bits((alpha | beta) & outline.edges)) {
    const Cuts cuts = cuts_between(f[edges.ends[e][0]], f[edges.ends[e][1]], range);
    int n = 0;
    if (alpha >> e & 1) c.cut[e][0] = std::uint16_t(2 * cuts.q[n++] + 1);
    if (beta >> e & 1) c.cut[e][1] = std::uint16_t(2 * cuts.q[n] + 1);
  }
  return c;
}

// The cuts on the subdivision edges; comes back with how many.
std::size_t cuts_of(const Around& f, const DiamondContext& c, const Range& range, std::uint8_t* cuts) {
  const Side centre = side_of(f[kCentre], range);
  std::size_t n = 0;
  for (int v = 0; v < c.row->vertices; ++v) {
    if (!c.has(v) || c.side(v) == centre) continue;
    const Cuts q = cuts_between(f[kCentre], f[v], range);
    for (int i = 0; i < q.count; ++i) cuts[n++] = q.q[i];
  }
  return n;
}

// Tetrahedra of the patch in one tetrahedron of a diamond, or one of its halves. local: its vertices.
unsigned patch_tets(const TetCases& cases, const Domain& domain, const Diamond& d, const Outline& outline, std::uint32_t sides,
                    const std::array<std::uint8_t, 4>& local, const TetShape& known) {
  if (outline.interior) return cases.count(known.order, shape_sides(known, sides));
  const auto positions = domain.positions(d, local);
  if (!Domain::exists(positions)) return 0;
  const TetShape shape = shape_of(positions, local, d.row->belt);
  return cases.count(shape.order, shape_sides(shape, sides));
}

// Leaves of the full mesh that a split diamond leaves: the halves that go to children that are never split. split: a bit for each child that is.
std::uint64_t leaves(const TetCases& cases, const Domain& domain, const Diamond& d, const Outline& outline, std::uint32_t sides, unsigned split) {
  const std::uint32_t belt = sides >> 4 & ((1u << 2 * d.row->belt) - 1), ring = belt | belt << 2 * d.row->belt, centre = sides >> (2 * kCentre);
  std::uint64_t n = 0;
  for (int k = 0; k < d.row->children; ++k) {
    if (split >> k & 1) continue;
    for (const Duet::Half& half : d.row->child[k].half) {
      if (!(outline.tets >> half.tet & 1)) continue;
      // The end that stays, both belt vertices, the centre: that is mostly enough.
      const unsigned count = cases.count((sides >> (2 * half.end) & 3) | (ring >> (2 * half.tet) & 15) << 2 | centre << 6);
      if (count == 0 || (outline.interior && count != TetCases::kDepends)) {
        n += count;
        continue;
      }
      auto local = d.row->tet(half.tet);
      local[1 - half.end] = kCentre;
      n += patch_tets(cases, domain, d, outline, sides, local, d.row->half_shape[half.tet][half.end]);
    }
  }
  return n;
}

// A bit for each child that is in the set.
unsigned children_in_set(SetNeighbours& neighbours, int slot) {
  unsigned some = 0, bit = 1;
  for (const Link link : neighbours.children(slot)) {
    if (neighbours.at(link.where).has(link.slot)) some |= bit;
    bit <<= 1;
  }
  return some;
}

float round_up(double error) {
  if (error >= std::numeric_limits<float>::max()) return std::numeric_limits<float>::max();
  const float f = float(error);
  return f < error ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

}  // namespace

FieldHierarchy::FieldHierarchy(const Volume& volume, const BuildOptions& options)
    : volume_(volume), range_(options.range), refine_(options.refine), domain_(volume.grid.dims) {
  for (int scale = 0; scale < domain_.levels(); ++scale) outlines_.emplace_back(domain_, scale);
  Relevance found = find_relevant(volume_, range_, refine_, outlines_);
  set_ = std::move(found.set);
  unit_cuts_ = found.unit_cuts;
  measure_errors(options.progress);
  saturate(errors_);
}

void FieldHierarchy::measure_errors(const std::function<void(double)>& progress) {
  errors_.assign(set_.size(), 0);
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    const Extremes<T> extremes(field);
    for (int scale = 0; scale < domain_.levels(); ++scale) {
      const DiamondErrors<T> error_of(field, extremes, domain_, scale);
      const auto [begin, end] = set_.of_scale(scale);
      tbb::parallel_for(tbb::blocked_range<std::uint32_t>(begin, end, 1), [&](const auto& some) {
        for (std::uint32_t brick = some.begin(); brick != some.end(); ++brick) {
          set_.for_each_supercube(brick, [&](std::uint32_t s, SupercubeKey key) {
            const SupercubeDiamonds diamonds(outlines_, key);
            UpdateIndex next = set_.first(brick, s);
            for (const int slot : set_bits(set_.occupancy()[s])) {
              const Diamond d = diamonds.diamond(slot);
              const Outline& outline = diamonds.outline(slot);
              double error = 0;
              if (scale < kShared) {
                error = error_of(d, outline);
              } else {
                error = tbb::parallel_reduce(
                    tbb::blocked_range<int>(0, d.row->tets, 1), 0.0,
                    [&](const auto& tets, double worst) {
                      for (int i = tets.begin(); i != tets.end(); ++i) worst = std::max(worst, error_of(d, outline, 1u << i));
                      return worst;
                    },
                    [](double a, double b) { return std::max(a, b); });
              }
              errors_[next++] = round_up(error);
            }
          });
        }
      });
      // Every scale goes over the whole box, at most: that share of the work is done.
      if (progress) progress(double(scale + 1) / domain_.levels());
    }
  });
}

// Makes each no smaller than those of the relevant children.
void FieldHierarchy::saturate(std::vector<float>& errors) const {
  for (int scale = 0; scale < domain_.levels(); ++scale) {
    const auto [begin, end] = set_.of_scale(scale);
    for (int cls = scale > 0 ? 2 : 1; cls >= 0; --cls) {
      tbb::parallel_for(begin, end, [&](std::uint32_t brick) {
        SetNeighbours neighbours(set_);
        set_.for_each_supercube(brick, [&](std::uint32_t s, SupercubeKey key) {
          const std::uint64_t slots = set_.occupancy()[s] & kSlotsOfClass[cls];
          if (slots == 0) return;
          neighbours.move_to(key);
          UpdateIndex next = set_.first(brick, s) + UpdateIndex(std::popcount(set_.occupancy()[s] & (slots - 1) & ~slots));
          for (const int slot : set_bits(slots)) {
            float& error = errors[next++];
            for (const Link link : neighbours.children(slot)) {
              const SetFinder::Found& found = neighbours.at(link.where);
              if (found.has(link.slot)) error = std::max(error, errors[found.index(link.slot)]);
            }
          }
        });
      });
    }
  }
}

// What makes object errors of errors, supercube by supercube: of moves it is half, but no less than twice what points move in the mean, so that 99 %
// of them are within it also where all of a surface moves alike, as with labels.
std::vector<Yield> FieldHierarchy::yields(double max_error, const std::vector<UpdateCode>& codes, const std::vector<float>& levels) const {
  SurfaceMoves moves = surface_moves(volume_, range_, domain_, set_);
  saturate(moves.most);
  const double unit = yield_unit(volume_.grid, max_error);
  std::vector<Yield> yields(set_.supercubes());
  tbb::parallel_for(std::uint32_t(0), std::uint32_t(set_.bricks().size()), [&](std::uint32_t b) {
    set_.for_each_supercube(b, [&](std::uint32_t s, SupercubeKey key) {
      const UpdateIndex first = set_.first(b, s), end = first + UpdateIndex(std::popcount(set_.occupancy()[s]));
      const double width = diamond_width(volume_.grid) * double(1 << scale_of_key(key));
      double furthest = 0, ratio = 0;
      for (UpdateIndex i = first; i < end; ++i) {
        const double error = double(levels[codes[i].error_level()]);
        if (error == 0) continue;
        furthest = std::max(furthest, double(moves.most[i]));
        ratio = std::max(ratio, double(moves.most[i]) / error);
      }
      const double share = furthest > 0 ? std::clamp(2 * double(moves.mean[s]) / furthest, 0.5, 1.0) : 1;
      yields[s] = Yield::at_least(share * ratio, unit, furthest > width * (1 + 1e-6));
    });
  });
  return yields;
}

double FieldHierarchy::value(Vertex v) const {
  return visit_samples(volume_, [&]<class T>(std::span<const T> samples) { return Field<T>{samples, domain_.last()}.at(domain_.clamp(v)); });
}

Side FieldHierarchy::side(Vertex v) const { return side_of(value(v), range_); }

RootPatch FieldHierarchy::root_patch() const {
  const Diamond root(domain_.root());
  const unsigned edges = Domain::edges(*root.row, domain_.tets(root));
  RootPatch root_patch;
  for (int v = 0; v < kRootVertices; ++v) root_patch.side[v] = side(root.vertex(v));
  for (int e = 0; e < kRootEdges; ++e) {
    const auto [a, b] = edge_ends(e, root.row->belt);
    if (edges >> e & 1) root_patch.cuts[e] = cuts_between(value(root.vertex(a)), value(root.vertex(b)), range_);
  }
  return root_patch;
}

DiamondContext FieldHierarchy::context(const Diamond& d) const {
  const Outline outline = Outlines::outline_of(domain_, d);
  return visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    return context_of(around(Field<T>{samples, domain_.last()}, domain_, d, outline), outline, range_);
  });
}

std::vector<std::uint8_t> FieldHierarchy::cuts(const Diamond& d) const {
  const Outline outline = Outlines::outline_of(domain_, d);
  std::vector<std::uint8_t> cuts(kMaxCuts);
  cuts.resize(visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Around f = around(Field<T>{samples, domain_.last()}, domain_, d, outline);
    return cuts_of(f, context_of(f, outline, range_), range_, cuts.data());
  }));
  return cuts;
}

Result<IntervalVolume> FieldHierarchy::compact() const {
  IntervalVolume::Parts parts;
  Description& d = parts.description;
  d.name = volume_.name;
  d.grid = volume_.grid;
  d.range = range_;
  d.refine = refine_;
  d.root_patch = encode_root_patch(root_patch());
  parts.set = set_;
  parts.error_levels = choose_error_levels(errors_, kErrorLevels);
  d.max_error = parts.error_levels.empty() ? 0.0 : double(parts.error_levels.back());
  parts.codes.resize(set_.size());
  const TetCases& cases = tet_cases();
  const LevelFinder level_of(parts.error_levels);
  // Each brick's by themselves; then all in one.
  struct Part {
    std::vector<std::uint8_t> residuals;
    FullMesh full;
    std::vector<Vertex> moved;  // inside, where clamping takes centres that lie outside the box
  };
  std::vector<Part> by_brick(set_.bricks().size());
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(by_brick.size()), [&](std::uint32_t b) {
      Part& part = by_brick[b];
      SetNeighbours neighbours(set_);
      set_.for_each_supercube(b, [&](std::uint32_t s, SupercubeKey key) {
        const SupercubeDiamonds diamonds(outlines_, key);
        neighbours.move_to(key);
        UpdateIndex next = set_.first(b, s);
        for (const int slot : set_bits(set_.occupancy()[s])) {
          const Diamond diamond = diamonds.diamond(slot);
          const Outline& outline = diamonds.outline(slot);
          const Around f = around(field, domain_, diamond, outline);
          const Side centre = side_of(f[kCentre], range_);
          const DiamondContext c = context_of(f, outline, range_);
          std::array<std::uint8_t, kMaxCuts> cuts, coded;
          const std::size_t n = cuts_of(f, c, range_, cuts.data());
          Prediction prediction(c);
          prediction.encode(centre, std::span(cuts).first(n), coded.data());
          part.residuals.insert(part.residuals.end(), coded.begin(), coded.begin() + std::ptrdiff_t(n));
          parts.codes[next] = UpdateCode((unsigned(centre) + 3 - unsigned(prediction.side())) % 3, unsigned(n), unsigned(c.count_cuts(centre).first),
                                         unsigned(level_of(errors_[next])));
          part.full.tets +=
              leaves(cases, domain_, diamond, outline, c.sides | std::uint32_t(centre) << (2 * kCentre), children_in_set(neighbours, slot));
          ++next;
          if (centre != Side::inside) continue;
          if (domain_.contains(diamond.centre))
            ++part.full.vertices;
          else
            part.moved.push_back(domain_.clamp(diamond.centre));
        }
      });
    });
  });
  parts.yields = yields(d.max_error, parts.codes, parts.error_levels);
  // Vertices of the full mesh are cuts of unit edges, for every longer edge with different sides is the spine of a relevant diamond, and samples
  // inside the range that are centres of relevant diamonds or the root's corners.
  d.full.vertices = unit_cuts_;
  std::vector<Vertex> moved;
  const Diamond root(domain_.root());
  for (int v = 0; v < kRootVertices; ++v) {
    if (side(root.vertex(v)) == Side::inside) moved.push_back(domain_.clamp(root.vertex(v)));
  }
  std::size_t total = 0;
  for (const Part& part : by_brick) {
    total += part.residuals.size();
    d.full.vertices += part.full.vertices;
    d.full.tets += part.full.tets;
    moved.insert(moved.end(), part.moved.begin(), part.moved.end());
  }
  std::sort(moved.begin(), moved.end(), [](Vertex a, Vertex b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); });
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  for (Vertex v : moved) d.full.vertices += v == Vertex{} || !set_.find(v);
  if (set_.size() == 0) {
    std::uint32_t sides = 0;
    for (int v = 0; v < kRootVertices; ++v) sides |= std::uint32_t(side(root.vertex(v))) << (2 * v);
    const Outline outline = Outlines::outline_of(domain_, root);
    for (int i = 0; i < root.row->tets; ++i) {
      if (outline.tets >> i & 1) d.full.tets += patch_tets(cases, domain_, root, outline, sides, root.row->tet(i), root.row->shape[i]);
    }
  }
  parts.residuals.reserve(total);
  for (Part& part : by_brick) {
    parts.residuals.insert(parts.residuals.end(), part.residuals.begin(), part.residuals.end());
    part = {};
  }
  return IntervalVolume::assemble(std::move(parts));
}

}  // namespace intervale
