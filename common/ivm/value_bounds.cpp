#include "common/ivm/value_bounds.h"

#include <bit>
#include <vector>

#include "common/codec/value_prediction.h"
#include "common/ivm/block_lattice.h"
#include "common/ivm/saturate.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// The bounds of each diamond's own values, by number.
void find_own_bounds(const PagedValues& values, ValueKeys& least, ValueKeys& greatest, const ParallelFor& parallel) {
  const SupercubeSet& set = values.set;
  const std::vector<BrickRun> blocks = blocks_of(set);
  parallel(blocks.size(), [&](std::size_t block) {
    BlockLattice lattice(values);
    lattice.move_to(block_of(set.bricks()[blocks[block].first].key), BlockLattice::Load::all);
    VertexKeys around{};
    for (BrickIndex brick = blocks[block].first; brick < blocks[block].end; ++brick) {
      set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
        const BlockLattice::Point first = lattice.at(key);
        UpdateIndex i = set.first(brick, s);
        for (const Slot slot : set_bits<Slot>(set.occupancy()[s])) {
          const BlockLattice::Point centre = first + BlockLattice::of_slot(slot);
          lattice.gather(centre, slot, around);
          KeySpan span{lattice.key(centre), lattice.key(centre)};
          for (std::size_t v = 0; v < std::size_t(diamond_type(kTypeOfSlot[slot]).vertices); ++v) {
            if (around[v] != kNoKey) span.add(around[v]);
          }
          least.set(i, span.least);
          greatest.set(i, span.greatest);
          ++i;
        }
      });
    }
  });
}

// The first keys, so many.
ValueKeys first_of(const ValueKeys& keys, std::size_t count, ValueKey last) {
  ValueKeys first(count, last);
  for (std::size_t i = 0; i < count; ++i) first.set(i, keys[i]);
  return first;
}

}  // namespace

ValueBounds::ValueBounds(const PagedValues& values, const ParallelFor& parallel) {
  const SupercubeSet& set = values.set;
  const ValueKey last = values.format.last;
  ValueKeys least(set.size(), last), greatest(set.size(), last);
  find_own_bounds(values, least, greatest, parallel);
  for_each_child(set, kMaxLevels, parallel, [&](UpdateIndex diamond, UpdateIndex child) {
    least.set(diamond, std::min(least[diamond], least[child]));
    greatest.set(diamond, std::max(greatest[diamond], greatest[child]));
  });
  supercube_least_ = supercube_greatest_ = ValueKeys(set.supercubes(), last);
  brick_least_ = brick_greatest_ = ValueKeys(set.bricks().size(), last);
  parallel(set.bricks().size(), [&](std::size_t b) {
    const BrickIndex brick{std::uint32_t(b)};
    KeySpan all{least[set.bricks()[brick].first], greatest[set.bricks()[brick].first]};
    set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey) {
      const UpdateIndex first = set.first(brick, s), end = first + std::uint32_t(std::popcount(set.occupancy()[s]));
      KeySpan span{least[first], greatest[first]};
      for (UpdateIndex i = first; i < end; ++i) {
        span.least = std::min(span.least, least[i]);
        span.greatest = std::max(span.greatest, greatest[i]);
      }
      supercube_least_.set(s, span.least);
      supercube_greatest_.set(s, span.greatest);
      all = {std::min(all.least, span.least), std::max(all.greatest, span.greatest)};
    });
    brick_least_.set(brick, all.least);
    brick_greatest_.set(brick, all.greatest);
  });
  const std::size_t coarse = coarse_diamonds(set);
  least_ = first_of(least, coarse, last);
  greatest_ = first_of(greatest, coarse, last);
}

}  // namespace intervale
