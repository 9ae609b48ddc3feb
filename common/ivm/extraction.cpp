#include "common/ivm/extraction.h"

#include <array>
#include <span>
#include <string>

#include "common/util/bits.h"

namespace intervale {
namespace {

tl::unexpected<Error> misfit(Vertex c) {
  return fail("the interval volume is damaged: the update at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) +
              ") does not fit the ones before it");
}

}  // namespace

Front root_front(const Description& d, const ShownRange& shown) { return {d.grid, d.format, d.corners, shown.range, shown.refine}; }

Result<Extraction> extract(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod, const ParallelFor& parallel) {
  if (auto ok = check_lod(lod); !ok) return tl::unexpected(ok.error());
  const SupercubeSet& set = volume.set();
  const SplitSet chosen = select(volume, relevant, lod);
  Extraction result{root_front(volume.description(), relevant.shown())};
  Front& front = result.front;
  if (!lod.max_tets && !lod.max_updates) {
    const auto keys_of = [&](const SlotGroup& g, std::span<ValueKey, kSlots> keys) {
      UpdateIndex i = set.first(g.brick, g.supercube);
      for (const Slot slot : set_bits<Slot>(set.occupancy()[g.supercube])) keys[slot] = volume.key(i++);
    };
    if (const auto wrong = front.split_all(chosen.groups(set), keys_of, parallel)) return misfit(*wrong);
    result.updates = front.shown_count();
    return result;
  }
  for (const UpdateIndex i : in_order(volume, relevant, chosen, lod)) {
    if (lod.max_updates && front.split_count() == *lod.max_updates) break;
    const Place p = set.place(i);
    FrontCursor cursor(front.state());
    cursor.move_to(p.key);
    if (!cursor.find(p.slot)) return misfit(SupercubeSet::centre(p));
    front.split(cursor, volume.key(i), lod.max_tets.value_or(~std::uint64_t(0)));
    if (front.withheld_count() > 0) break;
  }
  result.updates = front.shown_count();
  return result;
}

}  // namespace intervale
