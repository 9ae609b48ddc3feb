#include "common/ivm/relevant_slots.h"

#include <bit>

#include "common/codec/value_prediction.h"
#include "common/diamond/split_set.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/split_lattice.h"
#include "common/ivm/value_bounds.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// Finds the diamonds of one volume that are relevant to one range.
class Finder {
 public:
  Finder(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel)
      : volume_(volume),
        set_(volume.set()),
        bounds_(volume.bounds(parallel)),
        counts_(KeySides(volume.description().format, shown.range), shown.refine),
        parallel_(parallel),
        all_(set_.size()),
        slots_(set_.supercubes()) {}

  std::vector<std::uint64_t> find() && {
    const auto [first, end] = set_.of_scale(0);
    parallel_(first, [&](std::size_t b) {
      const BrickIndex brick{std::uint32_t(b)};
      set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey) { find_coarse(brick, s); });
    });
    all_.insert_all();
    parallel_(end - first, [&, first = first](std::size_t piece) { find_fine(BrickIndex(first + std::uint32_t(piece))); });
    for (const std::size_t cls : {2, 1}) {
      parallel_(end - first, [&, first = first](std::size_t piece) { add_parents(BrickIndex(first + std::uint32_t(piece)), cls); });
    }
    return std::move(slots_);
  }

 private:
  // Of scale 1 or coarser: as the bounds say.
  void find_coarse(BrickIndex brick, SupercubeIndex s) {
    if (!bounds_.is_relevant(counts_, s)) return;
    UpdateIndex next = set_.first(brick, s);
    for (const Slot slot : set_bits<Slot>(set_.occupancy()[s])) slots_[s] |= std::uint64_t(bounds_.is_relevant(counts_, next++)) << slot;
  }

  // Of scale 0: those that count.
  void find_fine(BrickIndex brick) {
    SplitLattice lattice(volume_, all_);
    set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      if (!bounds_.is_relevant(counts_, s)) return;
      lattice.move_to(key);
      (void)lattice.splittable(set_.occupancy()[s]);
      UpdateIndex next = set_.first(brick, s);
      next = add_counting<0>(lattice, s, next);
      next = add_counting<1>(lattice, s, next);
      add_counting<2>(lattice, s, next);
    });
  }
  template <int Class>
  UpdateIndex add_counting(const SplitLattice& lattice, SupercubeIndex s, UpdateIndex next) {
    VertexKeys around;
    for (const Slot slot : set_bits<Slot>(set_.occupancy()[s] & kSlotsOfClass[Class])) {
      KeySpan span = lattice.gather<Class>(slot, around);
      span.add(volume_.key(next++));
      slots_[s] |= std::uint64_t(counts_(span.least, span.greatest)) << slot;
    }
    return next;
  }

  // Of scale 0: the parents of a class's relevant diamonds, but those of coarser scales.
  void add_parents(BrickIndex brick, std::size_t cls) {
    SetNeighbours around(set_);
    set_.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      const std::uint64_t chosen = __atomic_load_n(&slots_[s], __ATOMIC_RELAXED) & kSlotsOfClass[cls];
      if (chosen == 0) return;
      around.move_to(key);
      for (const Slot slot : set_bits<Slot>(chosen)) {
        const Links& links = around.links(slot);
        for (std::size_t k = 0; k < std::size_t(diamond_type(kTypeOfSlot[slot]).parents); ++k) {
          const auto parent = around.at(links.vertex[links.parent[k]]);
          if (!parent.supercube.has(parent.slot) || scale_of_key(parent.supercube.key) != 0) continue;
          __atomic_fetch_or(&slots_[parent.supercube.supercube], std::uint64_t(1) << parent.slot, __ATOMIC_RELAXED);
        }
      }
    });
  }

  const IntervalVolume& volume_;
  const SupercubeSet& set_;
  const ValueBounds& bounds_;
  CountingKeys counts_;
  const ParallelFor& parallel_;
  SplitSet all_;  // of the volume's updates
  std::vector<std::uint64_t> slots_;
};

}  // namespace

std::vector<std::uint64_t> relevant_slots(const IntervalVolume& volume, const ShownRange& shown, const ParallelFor& parallel) {
  return Finder(volume, shown, parallel).find();
}

}  // namespace intervale
