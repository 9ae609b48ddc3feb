#include "common/ranges/update_slopes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/relevant_updates.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

struct Cluster {
  float removed = 0, updates = 1, slope = removed / updates;
};

// Calls visit(update, key, slot, neighbours) for each diamond of one class of a scale.
template <class Visit>
void for_each_of_class(const SupercubeSet& set, int scale, int cls, const ParallelFor& parallel, const Visit& visit) {
  const auto [begin, end] = set.of_scale(scale);
  parallel(end - begin, [&, begin = begin](std::size_t piece) {
    const BrickIndex brick(begin + std::uint32_t(piece));
    SetNeighbours around(set);
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      const std::uint64_t occupancy = set.occupancy()[s];
      const UpdateIndex first = set.first(brick, s);
      around.move_to(key);
      for (const Slot slot : set_bits<Slot>(occupancy & kSlotsOfClass[std::size_t(cls)]))
        visit(first + count_below(occupancy, slot), key, slot, around);
    });
  });
}

}  // namespace

std::vector<std::uint8_t> update_slopes(const SupercubeSet& set, std::span<const double> removed, int scales, int top_scale,
                                        const ParallelFor& parallel) {
  std::vector<Cluster> part(set.size());  // of a diamond's cluster: what each of its parents gets
  std::vector<std::uint8_t> slopes(set.size());
  const auto visit = [&](UpdateIndex i, SupercubeKey key, Slot slot, SetNeighbours& around) {
    const int scale = scale_of_key(key);
    std::array<Cluster, kMaxChildren> children;
    std::size_t count = 0;
    if (scale > 0 || class_of_slot(slot) < 2) {
      for (const Link link : around.children(slot)) {
        const auto child = around.at(link);
        if (child.supercube.has(child.slot)) children[count++] = part[child.supercube.index(child.slot)];
      }
    }
    Cluster own{.removed = float(std::max(removed[i], 0.0))};
    for (; count > 0; --count) {
      const auto steeper = [](const Cluster& a, const Cluster& b) { return a.slope < b.slope; };
      Cluster& best = *std::max_element(children.begin(), children.begin() + std::ptrdiff_t(count), steeper);
      if (best.slope <= own.slope) break;
      own = {own.removed + best.removed, own.updates + best.updates};
      best = children[count - 1];
    }
    slopes[i] = std::uint8_t(scale > top_scale ? kMaxSlope : slope_of(own.slope));
    int parents = 0;
    for_each_parent(around, key, slot, [&parents](const SetNeighbours::Diamond&) { ++parents; });
    const auto shares = float(std::max(parents, 1));
    part[i] = {own.removed / shares, own.updates / shares};
  };
  for (int scale = 0; scale < scales; ++scale) {
    for (int cls = 2; cls >= 0; --cls) for_each_of_class(set, scale, cls, parallel, visit);
  }
  return slopes;
}

}  // namespace intervale
