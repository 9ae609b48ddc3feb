#include "common/ivm/refinement.h"

#include <algorithm>
#include <limits>

#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/ranking.h"
#include "common/util/bits.h"

namespace intervale {

SplitSet select(const SupercubeSet& set, const std::function<bool(const Place&)>& wants) {
  SplitSet chosen(set.size());
  SetNeighbours around(set);
  set.for_each_up([&](const Place& p) {
    if (!chosen.contains(p.index)) {
      if (!wants(p)) return;
      chosen.insert(p.index);
    }
    for_each_parent(around, p.key, p.slot, [&](UpdateIndex parent) { chosen.insert(parent); });
  });
  return chosen;
}

SplitSet select(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod) {
  // Skips bricks in which nothing is wanted.
  const Ranking ranking(volume, relevant, lod);
  SplitSet wanted(volume.size());
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
        if ((slots >> slot & 1) != 0 && rank(i, slot) != 0) wanted.insert(i);
        ++i;
      }
    });
  }
  return select(set, [&wanted](const Place& p) { return wanted.contains(p.index); });
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
      const std::uint64_t occupancy = set.occupancy()[s], slots = needs.slots(n++, occupancy);
      UpdateIndex i = set.first(b, s);
      for (const Slot slot : set_bits<Slot>(occupancy)) {
        if ((slots >> slot & 1) != 0 && updates.contains(i)) ranks[i] = rank(i, slot);
        ++i;
      }
    });
  }
  SetNeighbours around(set);
  set.for_each_up([&](const Place& p) {
    if (!updates.contains(p.index)) return;
    for_each_parent(around, p.key, p.slot, [&](UpdateIndex parent) { ranks[parent] = std::max(ranks[parent], ranks[p.index]); });
  });
  // A counting sort over the coarse to fine order.
  constexpr std::size_t kRanks = std::numeric_limits<Ranking::Rank>::max() + std::size_t(1);
  std::vector<std::size_t> begin(kRanks + 1, 0);
  for (UpdateIndex i{0}; i < volume.size(); ++i) {
    if (updates.contains(i)) ++begin[kRanks - ranks[i]];
  }
  for (std::size_t k = 0; k < kRanks; ++k) begin[k + 1] += begin[k];
  std::vector<UpdateIndex> order(begin[kRanks]);
  set.for_each_down([&](const Place& p) {
    if (updates.contains(p.index)) order[begin[kRanks - 1 - ranks[p.index]]++] = p.index;
  });
  return order;
}

}  // namespace intervale
