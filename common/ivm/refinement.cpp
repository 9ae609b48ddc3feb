#include "common/ivm/refinement.h"

#include <algorithm>
#include <limits>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/ranking.h"
#include "common/util/bits.h"

namespace intervale {

SplitSet select(const SupercubeSet& set, const std::function<bool(const Place&)>& wants) {
  std::vector<std::uint64_t> slots(set.supercubes());  // that are chosen
  SetNeighbours around(set);
  set.for_each_up([&](const Place& p) {
    const std::uint64_t slot = std::uint64_t(1) << p.slot;
    if ((slots[p.supercube] & slot) == 0) {
      if (!wants(p)) return;
      slots[p.supercube] |= slot;
    }
    for_each_parent(around, p.key, p.slot,
                    [&](const SetNeighbours::Diamond& parent) { slots[parent.supercube.supercube] |= std::uint64_t(1) << parent.slot; });
  });
  SplitSet chosen(set);
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) { chosen.insert(b, key, slots[s]); });
  }
  return chosen;
}

SplitSet select(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod) {
  // Skips bricks in which nothing is wanted.
  const Ranking ranking(volume, relevant, lod);
  std::vector<std::uint64_t> wanted(volume.set().supercubes());  // slots
  const SupercubeSet& set = volume.set();
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    const Ranking::Brick brick = ranking.of_brick(b);
    if (brick.bound() == 0) continue;
    const BrickNeeds needs = relevant.brick(b);
    std::size_t n = 0;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const Ranking::Supercube rank = brick.supercube(needs, s, key);
      const std::uint64_t occupancy = set.occupancy()[s], slots = needs.slots(n++, occupancy);
      UpdateIndex i = set.first(b, s);
      for (const Slot slot : set_bits<Slot>(occupancy)) {
        if ((slots >> slot & 1) != 0 && rank(i, slot) != 0) wanted[s] |= std::uint64_t(1) << slot;
        ++i;
      }
    });
  }
  return select(set, [&wanted](const Place& p) { return (wanted[p.supercube] >> p.slot & 1) != 0; });
}

std::vector<UpdateIndex> in_order(const IntervalVolume& volume, const RelevantUpdates& relevant, const SplitSet& updates, const Lod& lod) {
  const Ranking ranking(volume, relevant, lod);
  const SupercubeSet& set = volume.set();
  std::vector<Ranking::Rank> ranks(volume.size());
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    const Ranking::Brick brick = ranking.of_brick(b);
    const BrickNeeds needs = relevant.brick(b);
    std::size_t n = 0;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const Ranking::Supercube rank = brick.supercube(needs, s, key);
      const std::uint64_t occupancy = set.occupancy()[s], slots = needs.slots(n++, occupancy) & updates.slots(b, key);
      UpdateIndex i = set.first(b, s);
      for (const Slot slot : set_bits<Slot>(occupancy)) {
        if ((slots >> slot & 1) != 0) ranks[i] = rank(i, slot);
        ++i;
      }
    });
  }
  SetNeighbours around(set);
  set.for_each_up([&](const Place& p) {
    if (!updates.contains(p)) return;
    for_each_parent(around, p.key, p.slot, [&](const SetNeighbours::Diamond& parent) {
      Ranking::Rank& rank = ranks[parent.index()];
      rank = std::max(rank, ranks[p.index]);
    });
  });
  // A counting sort over the coarse to fine order.
  constexpr std::size_t kRanks = std::numeric_limits<Ranking::Rank>::max() + std::size_t(1);
  std::vector<std::size_t> begin(kRanks + 1, 0);
  set.for_each_down([&](const Place& p) {
    if (updates.contains(p)) ++begin[kRanks - ranks[p.index]];
  });
  for (std::size_t k = 0; k < kRanks; ++k) begin[k + 1] += begin[k];
  std::vector<UpdateIndex> order(begin[kRanks]);
  set.for_each_down([&](const Place& p) {
    if (updates.contains(p)) order[begin[kRanks - 1 - ranks[p.index]]++] = p.index;
  });
  return order;
}

}  // namespace intervale
