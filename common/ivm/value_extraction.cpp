#include "common/ivm/value_extraction.h"

#include <algorithm>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/supercube_neighbours.h"

namespace intervale {
namespace {

tl::unexpected<Error> misfit(Vertex c) {
  return fail("the data set is damaged: the diamond at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) +
              ") cannot be split after the ones before it");
}

// The chosen diamonds by error level, greatest first, where an ancestor has at least the level of its descendants;
// equal ones from coarse to fine.
std::vector<Place> in_order(const ValueVolume& volume, std::span<const SlotGroup> groups) {
  const SupercubeSet& set = volume.set();
  std::vector<ErrorLevel> levels(set.size());
  SetNeighbours around(set);
  for_each_finest_first(groups, [&](const SlotGroup& group, std::uint64_t slots) {
    around.move_to(group.key);
    for (const Slot slot : set_bits<Slot>(slots)) {
      const Links& links = around.links(slot);
      const UpdateIndex i = set.place_in(group.brick, group.supercube, group.key, slot).index;
      levels[i] = std::max(levels[i], volume.error_level(i, around, slot));
      for (std::size_t k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
        const auto parent = around.at(links.vertex[links.parent[k]]);
        if (!parent.supercube.has(parent.slot)) continue;
        ErrorLevel& level = levels[parent.supercube.index(parent.slot)];
        level = std::max(level, levels[i]);
      }
    }
  });
  std::array<std::vector<Place>, kErrorLevels> by_level;
  for (std::size_t begin = 0, end = 0; begin < groups.size(); begin = end) {
    while (end < groups.size() && scale_of_key(groups[end].key) == scale_of_key(groups[begin].key)) ++end;
    for (const std::uint64_t slots : kSlotsOfClass) {
      for (const SlotGroup& g : groups.subspan(begin, end - begin)) {
        for (const Slot slot : set_bits<Slot>(g.slots & slots)) {
          const Place p = set.place_in(g.brick, g.supercube, g.key, slot);
          by_level[levels[p.index]].push_back(p);
        }
      }
    }
  }
  std::vector<Place> order;
  for (std::size_t level = kErrorLevels; level-- > 0;) order.insert(order.end(), by_level[level].begin(), by_level[level].end());
  return order;
}

}  // namespace

Result<Extraction> extract(const ValueVolume& volume, const RangeLod& wanted, const ParallelFor& parallel) {
  const Lod& lod = wanted.lod;
  if (auto ok = check_lod(lod); !ok) return tl::unexpected(ok.error());
  if (lod.camera) return misuse("a data set of every range has no errors on a screen yet: build it with --range for --eye");
  const FieldDescription& d = volume.description();
  const std::vector<SlotGroup> groups = select(volume, wanted, parallel);
  Extraction result{Front(d.grid, d.format, d.corners, wanted.range, wanted.refine)};
  if (!lod.max_tets && !lod.max_updates) {
    const auto keys_of = [&volume](const SlotGroup& g, std::span<ValueKey, kSlots> keys) {
      const SupercubeSet& set = volume.set();
      UpdateIndex i = set.first(g.brick, g.supercube);
      for (const Slot slot : set_bits<Slot>(set.occupancy()[g.supercube])) keys[slot] = volume.key(i++);
    };
    if (const auto wrong = result.front.split_all(groups, keys_of, parallel)) return misfit(*wrong);
    result.updates = result.front.shown_count();
    return result;
  }
  for (const Place& p : in_order(volume, groups)) {
    const Vertex c = SupercubeSet::centre(p);
    FrontCursor cursor(result.front.state());
    cursor.move_to(p.key);
    if (!cursor.find(p.slot)) return misfit(c);
    result.front.split(cursor, volume.key(p.index), lod.max_tets.value_or(~std::uint64_t(0)));
    if (result.front.withheld_count() > 0) break;
    if (lod.max_updates && result.front.shown_count() > *lod.max_updates) {
      (void)result.front.merge(c);
      break;
    }
  }
  result.updates = result.front.shown_count();
  return result;
}

}  // namespace intervale
