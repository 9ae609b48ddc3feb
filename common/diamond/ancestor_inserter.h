// Inserts diamonds into a split set together with the ancestors that it lacks, a supercube at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"

namespace intervale {

class AncestorInserter {
 public:
  // Both must outlive it. split: closed under parents.
  AncestorInserter(const SupercubeSet& set, SplitSet& split);

  // Inserts diamonds of one supercube, and their ancestors. group: its slots are in the set, and none is split. Returns
  // what it inserted: supercubes may occur more than once. Fastest along neighbours. Valid until the next call.
  std::span<const SlotGroup> insert(const SlotGroup& group);
  // Takes back what the last call of insert() inserted.
  void take_back();

 private:
  void add(const SetFinder::Found& here, std::uint64_t slots);

  const SupercubeSet& set_;
  SplitSet& split_;
  std::vector<SetFinder> finders_;  // by scale
  std::vector<SlotGroup> inserted_;
};

}  // namespace intervale
