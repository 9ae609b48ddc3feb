#include "server/builder/field_hierarchy.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/saturate.h"
#include "common/ivm/value_page.h"
#include "common/parallel/all_cores.h"
#include "common/patch/tet_cases.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/error_to_distance.h"
#include "common/ranges/interpolation_error.h"
#include "common/util/bits.h"
#include "common/util/round_up.h"
#include "server/builder/error_steps.h"
#include "server/builder/find_keys.h"
#include "server/builder/relevance.h"
#include "server/builder/shared_error.h"
#include "server/builder/supercube_family.h"
#include "server/builder/value_steps.h"

namespace intervale {
namespace {

// The samples around a diamond, by local vertex.
using Around = std::array<double, kMaxVertices + 1>;

template <class T>
Around around(const Field<T>& field, const Domain& domain, const Diamond& d, const BorderShape& shape) {
  Around f{};
  if (shape.interior) {
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
    if (shape.vertices >> v & 1) f[v] = field.at(domain.clamp(d.vertex(v)));
  }
  f[kCentre] = field.at(domain.clamp(d.centre));
  return f;
}

// Tetrahedra of the patch in one tetrahedron of a diamond, or one of its halves. local: its vertices.
unsigned patch_tets(const TetCases& cases, const Domain& domain, const Diamond& d, const BorderShape& border, std::uint32_t sides,
                    const std::array<std::uint8_t, 4>& local, const TetShape& known) {
  if (border.interior) return cases.count(known.order, shape_sides(known, sides));
  const auto positions = domain.positions(d, local);
  if (!Domain::exists(positions)) return 0;
  const TetShape shape = shape_of(positions, local, d.row->belt);
  return cases.count(shape.order, shape_sides(shape, sides));
}

// The tetrahedra of the full mesh in a split diamond: the patches of the halves of children that are never split.
// split: a bit for each child that is.
std::uint64_t leaves(const TetCases& cases, const Domain& domain, const Diamond& d, const BorderShape& shape, std::uint32_t sides, unsigned split) {
  const std::uint32_t belt = sides >> 4 & ((1u << 2 * d.row->belt) - 1), ring = belt | belt << 2 * d.row->belt, centre = sides >> (2 * kCentre);
  std::uint64_t n = 0;
  for (int k = 0; k < d.row->children; ++k) {
    if (split >> k & 1) continue;
    for (const Duet::Half& half : d.row->child[k].half) {
      if (!(shape.tets >> half.tet & 1)) continue;
      // The end that stays, both belt vertices and the centre mostly determine the number.
      const unsigned count = cases.count((sides >> (2 * half.end) & 3) | (ring >> (2 * half.tet) & 15) << 2 | centre << 6);
      if (count == 0 || (shape.interior && count != TetCases::kDepends)) {
        n += count;
        continue;
      }
      auto local = d.row->tet(half.tet);
      local[1 - half.end] = kCentre;
      n += patch_tets(cases, domain, d, shape, sides, local, d.row->half_shape[half.tet][half.end]);
    }
  }
  return n;
}

// A bit for each child that is in the set.
unsigned children_in_set(SetNeighbours& neighbours, Slot slot) {
  unsigned some = 0, bit = 1;
  for (const Link link : neighbours.children(slot)) {
    if (neighbours.at(link.where).has(link.slot)) some |= bit;
    bit <<= 1;
  }
  return some;
}

}  // namespace

FieldHierarchy::FieldHierarchy(const Volume& volume, const BuildOptions& options)
    : volume_(volume), range_(options.range), refine_(options.refine), domain_(volume.grid.dims) {
  for (int scale = 0; scale < domain_.levels(); ++scale) shapes_.emplace_back(domain_, scale);
  Relevance found = find_relevant(volume_, range_, refine_, shapes_);
  set_ = std::move(found.set);
  unit_cuts_ = found.unit_cuts;
  measure_errors(options.progress, options.kept);
  saturate(set_, errors_, domain_.levels(), on_all_cores);
}

void FieldHierarchy::measure_errors(const std::function<void(double)>& progress, KeptErrors* kept) {
  errors_.assign(set_.size(), 0);
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    const Extremes<T> extremes(field, on_all_cores);
    for (int scale = 0; scale < domain_.levels(); ++scale) {
      const auto [begin, end] = set_.of_scale(scale);
      const auto number = [this](BrickIndex brick) { return brick < set_.bricks().size() ? std::size_t(set_.bricks()[brick].first) : set_.size(); };
      const std::span<float> of_scale = std::span(errors_).subspan(number(begin), number(end) - number(begin));
      if (kept != nullptr && kept->find_errors(scale, of_scale)) continue;
      const DiamondErrors<T> error_of(field, extremes, domain_, scale);
      tbb::parallel_for<std::uint32_t>(begin, end, [&](std::uint32_t b) {
        const BrickIndex brick(b);
        set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
          const SupercubeDiamonds diamonds(shapes_, key);
          UpdateIndex next = set_.first(brick, s);
          for (const Slot slot : set_bits<Slot>(set_.occupancy()[s])) {
            const Diamond d = diamonds.diamond(slot);
            const BorderShape& shape = diamonds.shape(slot);
            errors_[next++] = round_up(shared_error(error_of, d, shape));
          }
        });
      });
      if (kept != nullptr) kept->keep_errors(scale, of_scale);
      // Every scale visits the whole box at most once: an equal share of the work.
      if (progress) progress(double(scale + 1) / domain_.levels());
    }
  });
}

double FieldHierarchy::value(Vertex v) const {
  return visit_samples(volume_, [&]<class T>(std::span<const T> samples) { return Field<T>{samples, domain_.last()}.at(domain_.clamp(v)); });
}

Side FieldHierarchy::side(Vertex v) const { return side_of(value(v), range_); }

// What one brick's updates add to the interval volume, besides their values and errors.
struct FieldHierarchy::BrickPart {
  std::uint64_t coefficients = 0;
  FullMesh full;              // vertices: only samples that are centres
  std::vector<Vertex> moved;  // samples inside the range to which clamping moves centres outside the box
};

// Counts what one brick's updates add.
template <class T>
FieldHierarchy::BrickPart FieldHierarchy::count_brick(const Field<T>& field, BrickIndex brick) const {
  const TetCases& cases = tet_cases();
  BrickPart part;
  SetNeighbours neighbours(set_);
  set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
    const SupercubeDiamonds diamonds(shapes_, key);
    neighbours.move_to(key);
    for (const Slot slot : set_bits<Slot>(set_.occupancy()[s])) {
      const Diamond diamond = diamonds.diamond(slot);
      const BorderShape& shape = diamonds.shape(slot);
      const Around f = around(field, domain_, diamond, shape);
      const Side centre = side_of(f[kCentre], range_);
      std::uint32_t sides = std::uint32_t(centre) << (2 * kCentre);
      for (const int v : set_bits(shape.vertices)) {
        const Side side = side_of(f[std::size_t(v)], range_);
        sides |= std::uint32_t(side) << (2 * v);
        part.coefficients += std::uint64_t(cut_count(centre, side));
      }
      part.full.tets += leaves(cases, domain_, diamond, shape, sides, children_in_set(neighbours, slot));
      if (centre != Side::inside) continue;
      if (domain_.contains(diamond.centre))
        ++part.full.vertices;
      else
        part.moved.push_back(domain_.clamp(diamond.centre));
    }
  });
  return part;
}

// Vertices of the full mesh are cuts of unit edges, for every longer edge with different sides is the spine of a
// relevant diamond, and samples inside the range that are centres of relevant diamonds or the root's corners.
FullMesh FieldHierarchy::full_mesh(const std::vector<BrickPart>& parts) const {
  FullMesh full;
  full.vertices = unit_cuts_;
  const Diamond root(domain_.root());
  std::uint32_t sides = 0;
  std::vector<Vertex> moved;
  for (int v = 0; v < kRootVertices; ++v) {
    const Side at = side(root.vertex(v));
    sides |= std::uint32_t(at) << (2 * v);
    if (at == Side::inside) moved.push_back(domain_.clamp(root.vertex(v)));
  }
  for (const BrickPart& part : parts) {
    full.vertices += part.full.vertices;
    full.tets += part.full.tets;
    moved.insert(moved.end(), part.moved.begin(), part.moved.end());
  }
  std::sort(moved.begin(), moved.end(), [](Vertex a, Vertex b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); });
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  for (const Vertex v : moved) full.vertices += v == Vertex{} || !set_.find(v);
  if (set_.size() != 0) return full;
  // Nothing is relevant: the root's tetrahedra are the full mesh.
  const BorderShape shape = BorderShapes::shape_of(domain_, root);
  for (const int i : set_bits(shape.tets)) full.tets += patch_tets(tet_cases(), domain_, root, shape, sides, root.row->tet(i), root.row->shape[i]);
  return full;
}

Result<IntervalVolume> FieldHierarchy::compact(const std::optional<ValueFormat>& format, bool is_exact) const {
  auto made = parts(format, is_exact);
  if (!made) return tl::unexpected(made.error());
  return IntervalVolume::assemble(std::move(*made));
}

Result<IntervalVolume::Parts> FieldHierarchy::parts(const std::optional<ValueFormat>& wanted, bool is_exact) const {
  const auto format = wanted ? Result<ValueFormat>(*wanted) : choose_value_format(volume_, 0.0);
  if (!format) return tl::unexpected(format.error());
  IntervalVolume::Parts parts;
  Description& d = parts.description;
  d.name = volume_.name;
  d.grid = volume_.grid;
  d.labels = volume_.labels;
  d.range = range_;
  d.refine = refine_;
  d.format = *format;
  d.is_exact = is_exact;
  d.corners = corner_keys(volume_, *format);
  parts.set = set_;
  parts.error_steps = choose_error_steps(errors_, kMaxErrorSteps);
  d.max_error = parts.error_steps.empty() ? 0.0 : double(parts.error_steps.back());
  const ErrorStepFinder step_of(parts.error_steps);
  parts.steps.reserve(set_.size());
  for (const float error : errors_) parts.steps.push_back(std::uint8_t(step_of(error)));
  parts.keys = ValueKeys(set_.size(), format->last);
  find_keys(volume_, *format, set_, parts.keys);
  drop_unused_values(d.format, d.corners, parts.keys);
  d.weights = fit_weights(parts, on_all_cores);
  std::vector<BrickPart> by_brick(set_.bricks().size());
  visit_samples(volume_, [&]<class T>(std::span<const T> samples) {
    const Field<T> field{samples, domain_.last()};
    tbb::parallel_for(std::uint32_t(0), std::uint32_t(by_brick.size()), [&](std::uint32_t b) { by_brick[b] = count_brick(field, BrickIndex(b)); });
  });
  for (const BrickPart& part : by_brick) d.coefficients += part.coefficients;
  d.full = full_mesh(by_brick);
  parts.surface = measure_error_to_distance(
      volume_, range_, domain_, set_, [&parts](UpdateIndex i) { return double(parts.error_steps[parts.steps[i]]); }, d.max_error, false,
      on_all_cores);
  return parts;
}

}  // namespace intervale
