#include "common/ivm/value_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/block_lattice.h"
#include "common/patch/key_sides.h"

namespace intervale {
namespace {

using Slots = std::vector<std::uint64_t>;  // by supercube

// Tells which diamonds are wanted for their own sake.
class Wanted {
 public:
  Wanted(const ValueVolume& volume, const RangeLod& wanted)
      : parts_(volume.parts()),
        domain_(volume.domain()),
        sides_(parts_.description.format, wanted.range),
        refine_(wanted.refine),
        threshold_(error_of(wanted.lod, parts_.description.max_error)) {
    while (threshold_ > 0 && least_level_ < kErrorLevels && volume.error(ErrorLevel(least_level_)) <= threshold_) ++least_level_;
    if (wanted.lod.roi) roi_ = in_samples(*wanted.lod.roi, parts_.description.grid);
  }

  // Adds the wanted slots of the supercubes of one block: bricks [first, end).
  void find(BlockLattice& lattice, BrickIndex first, BrickIndex end, Slots& slots) const {
    const SupercubeSet& set = parts_.set;
    const SupercubeKey key = set.bricks()[first].key;
    const bool is_finest = scale_of_key(key) == 0;
    lattice.move_to(block_of(key), BlockLattice::Load::all);
    VertexKeys around{};
    for (BrickIndex brick = first; brick < end; ++brick) {
      set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey supercube) {
        const BlockLattice::Point at = lattice.at(supercube);
        UpdateIndex next = set.first(brick, s);
        for (const Slot slot : set_bits<Slot>(set.occupancy()[s])) {
          const UpdateIndex i = next++;
          if (!is_finest && parts_.error_levels[i] < least_level_) continue;
          const BlockLattice::Point centre = at + BlockLattice::of_slot(slot);
          lattice.gather(centre, slot, around);
          if (!counts(diamond_type(kTypeOfSlot[slot]).vertices, around, lattice.key(centre))) continue;
          const Diamond d(centre_of(supercube, slot));
          if (is_finest && threshold_ > 0 && domain_.is_interior(d) &&
              spine_error(parts_.description.format, around[0], around[1], lattice.key(centre)) <= threshold_) {
            continue;
          }
          if (!roi_ || roi_->meets(d.centre, d.h)) slots[s] |= std::uint64_t(1) << slot;
        }
      });
    }
  }

 private:
  [[nodiscard]] bool counts(int vertices, const VertexKeys& around, ValueKey centre) const {
    ValueKey least = centre, greatest = centre;
    for (std::size_t v = 0; v < std::size_t(vertices); ++v) {
      if (around[v] == kNoKey) continue;
      least = std::min(least, around[v]);
      greatest = std::max(greatest, around[v]);
    }
    const Side low = sides_.side(least), high = sides_.side(greatest);
    return low != high || (refine_ == Refine::uniform && low == Side::inside);
  }

  const ValueVolume::Parts& parts_;
  const Domain& domain_;
  KeySides sides_;
  Refine refine_;
  double threshold_;
  int least_level_ = 0;
  std::optional<SampleBox> roi_;
};

// Adds all ancestors.
void close(const SupercubeSet& set, Slots& slots) {
  SetNeighbours around(set);
  for (int scale = 0; scale < kMaxLevels; ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (int cls = 2; cls >= 0; --cls) {
      for (BrickIndex brick = begin; brick < end; ++brick) {
        set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
          const std::uint64_t chosen = slots[s] & kSlotsOfClass[std::size_t(cls)];
          if (chosen == 0) return;
          around.move_to(key);
          for (const Slot slot : set_bits<Slot>(chosen)) {
            const Links& links = around.links(slot);
            for (std::size_t k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
              const auto parent = around.at(links.vertex[links.parent[k]]);
              if (parent.supercube.has(parent.slot)) slots[parent.supercube.supercube] |= std::uint64_t(1) << parent.slot;
            }
          }
        });
      }
    }
  }
}

}  // namespace

std::vector<SlotGroup> select(const ValueVolume& volume, const RangeLod& wanted, const ParallelFor& parallel) {
  const ValueVolume::Parts& parts = volume.parts();
  const SupercubeSet& set = parts.set;
  const Wanted chosen(volume, wanted);
  const std::vector<BrickRun> blocks = blocks_of(set);
  Slots slots(set.supercubes());
  parallel(blocks.size(), [&](std::size_t i) {
    BlockLattice lattice(parts);
    chosen.find(lattice, blocks[i].first, blocks[i].end, slots);
  });
  close(set, slots);
  std::vector<SlotGroup> groups;
  for (BrickIndex brick{0}; brick < set.bricks().size(); ++brick) {
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      if (slots[s] != 0) groups.push_back({brick, s, key, slots[s]});
    });
  }
  return groups;
}

}  // namespace intervale
