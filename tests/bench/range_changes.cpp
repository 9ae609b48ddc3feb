// How long a front that holds values takes to change its range: set_range, the mesh, and the boundary surface that the
// viewer draws, against the same splits applied again. One core.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/front/front.h"
#include "common/patch/visit_samples.h"
#include "common/ranges/border_shape.h"
#include "common/util/bits.h"
#include "server/builder/relevance.h"
#include "tests/bench/cases.h"
#include "tests/bench/timing.h"

namespace intervale::bench {
namespace {

constexpr int kRuns = 7;

struct Field {
  Case c;
  Domain domain;
  std::vector<BorderShapes> shapes;

  explicit Field(Case of) : c(std::move(of)), domain(c.volume->grid.dims) {
    for (int scale = 0; scale < domain.levels(); ++scale) shapes.emplace_back(domain, scale);
  }
  [[nodiscard]] ValueKey key(Vertex v) const {
    const Vertex at = domain.clamp(v);
    const auto& dims = c.volume->grid.dims;
    const std::size_t i = (std::size_t(at.z) * std::size_t(dims[1]) + std::size_t(at.y)) * std::size_t(dims[0]) + std::size_t(at.x);
    return visit_samples(*c.volume, [&](auto samples) { return c.format.key(double(samples[i])); });
  }
  [[nodiscard]] Front front(const Range& range) const {
    const Diamond root(domain.root());
    std::array<ValueKey, kRootVertices> corners{};
    for (int v = 0; v < kRootVertices; ++v) corners[std::size_t(v)] = key(root.vertex(v));
    return {c.volume->grid, c.format, corners, range, c.refine};
  }
  [[nodiscard]] std::vector<SlotGroup> relevant(const std::vector<Range>& ranges) const {
    std::map<SupercubeKey, std::uint64_t> slots;
    for (const Range& range : ranges) {
      const Relevance found = find_relevant(*c.volume, range, c.refine, shapes);
      for (BrickIndex b{0}; b < found.set.bricks().size(); ++b) {
        found.set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) { slots[key] |= found.set.occupancy()[s]; });
      }
    }
    return groups(slots);
  }
  [[nodiscard]] std::vector<SlotGroup> all() const {
    std::map<SupercubeKey, std::uint64_t> slots;
    for (int scale = 0; scale < domain.levels(); ++scale) {
      const BorderShapes& s = shapes[std::size_t(scale)];
      for (std::int32_t z = 0; z < s.count(2); ++z) {
        for (std::int32_t y = 0; y < s.count(1); ++y) {
          for (std::int32_t x = 0; x < s.count(0); ++x) {
            if (((x | y | z) & 1) == 0 || !s.of(s.position(0, x), s.position(1, y), s.position(2, z)).splits) continue;
            slots[supercube_key(scale, {x >> 2, y >> 2, z >> 2})] |= std::uint64_t(1) << kSlotOfType[type_of({x, y, z}, 0)];
          }
        }
      }
    }
    return groups(slots);
  }
  static std::vector<SlotGroup> groups(const std::map<SupercubeKey, std::uint64_t>& slots) {
    std::vector<SlotGroup> groups;
    groups.reserve(slots.size());
    for (const auto& [key, some] : slots) groups.push_back({{}, {}, key, some});
    return groups;
  }
};

// The diamonds of some groups, with their keys by supercube.
struct Splits {
  std::vector<SlotGroup> groups;
  std::vector<std::array<ValueKey, kSlots>> keys;
  Splits(const Field& field, std::vector<SlotGroup> of) : groups(std::move(of)), keys(groups.size()) {
    for (std::size_t i = 0; i < groups.size(); ++i) {
      groups[i].supercube = SupercubeIndex(std::uint32_t(i));
      for (const Slot slot : set_bits<Slot>(groups[i].slots)) keys[i][slot] = field.key(centre_of(groups[i].key, slot));
    }
  }
  void apply(Front& front) const {
    const auto keys_of = [this](const SlotGroup& g, std::span<ValueKey, kSlots> to) {
      std::copy(keys[g.supercube].begin(), keys[g.supercube].end(), to.begin());
    };
    if (front.split_all(groups, keys_of)) throw std::runtime_error("a diamond cannot be split");
  }
};

// Of a surface that is made anew: its triangles as they are drawn.
std::size_t triangles_made(BoundarySurface& surface) {
  std::size_t triangles = 0;
  for (const std::uint32_t id : surface.update().pieces) triangles += surface.piece(id, false).indices.size() / 3;
  return triangles;
}

void measure(const Field& field, const std::string& held, const std::vector<SlotGroup>& groups, const Range& from, const Range& to) {
  Front front = field.front(from);
  Splits(field, groups).apply(front);
  const Splits needed(field, field.relevant({to}));
  double set = 0, mesh = 0, again = 0, mesh_again = 0;
  std::vector<double> sets, meshes, surfaces, agains, meshes_again;
  BoundarySurface surface(front);
  for (int run = 0; run < kRuns; ++run) {
    front.set_range(from, field.c.refine);
    sets.push_back(seconds([&] {
      front.set_range(to, field.c.refine);
      return 0;
    }));
    meshes.push_back(seconds([&] { return front.mesh(); }));
    surfaces.push_back(seconds([&] { return triangles_made(surface); }));
    Front fresh = field.front(to);
    agains.push_back(seconds([&] {
      needed.apply(fresh);
      return 0;
    }));
    meshes_again.push_back(seconds([&] { return fresh.mesh(); }));
    if (fresh.tet_count() != front.tet_count()) throw std::runtime_error("the meshes differ");
  }
  set = median(sets), mesh = median(meshes), again = median(agains), mesh_again = median(meshes_again);
  const double shown = double(front.shown_count()) / 1e5, ms = 1000 / shown;
  fmt::print("| {} {} | {} | {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", field.c.name, range_text(to, field.c.refine), held,
             front.split_count(), front.shown_count(), set * ms, mesh * ms, (set + mesh) * ms, median(surfaces) * ms, again * ms, mesh_again * ms);
}

void measure_case(const Case& c) {
  const Field field(c);
  const double shift = (c.format.greatest() - c.format.least()) / 20;
  const Range to{c.range.alpha + shift, std::max(c.range.alpha + shift, c.range.beta)};
  measure(field, "both ranges", field.relevant({c.range, to}), c.range, to);
  measure(field, "whole field", field.all(), c.range, to);
}

int run(int argc, char** argv) {
  fmt::print("Milliseconds for 100,000 splits shown; medians of {} runs, one core. Alpha moves by 5 % of the field.\n\n", kRuns);
  fmt::print(
      "| range | held | splits held | shown | set_range | mesh | together | surface | splits again | mesh "
      "|\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
  for_each_case(argc, argv, measure_case);
  return 0;
}

}  // namespace
}  // namespace intervale::bench

// bench_range [CASE...]: cases as of cases.h; without any, samples of the product's own.
int main(int argc, char** argv) { return intervale::bench::run_or_report("bench_range", intervale::bench::run, argc, argv); }
