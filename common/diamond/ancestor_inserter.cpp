#include "common/diamond/ancestor_inserter.h"

#include <array>

namespace intervale {
namespace {

// The parents of a supercube's diamonds, by child: in the supercube itself, and in each neighbour that holds any.
struct Parents {
  struct Neighbour {
    int where = 0;
    Vertex to;                           // from the supercube's position, or from half of it for a coarser one
    std::uint64_t children = 0;          // slots of the supercube
    std::uint64_t any_parent = 0;        // slots of the neighbour
    std::vector<std::uint64_t> parents;  // slots of the neighbour, for each of `children`
  };
  std::array<std::uint64_t, kSlots> here{};
  std::vector<Neighbour> neighbours;
};

Parents parents_of(const std::array<Links, kSlots>& links) {
  std::array<std::array<std::uint64_t, kSlots>, kNeighbours> parents{};
  for (Slot slot{0}; slot < kSlots; ++slot) {
    for (int k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
      const Link link = links[slot].vertex[links[slot].parent[std::size_t(k)]];
      parents[link.where][slot] |= std::uint64_t(1) << link.slot;
    }
  }
  Parents all;
  all.here = parents[kHere];
  for (int where = 0; where < kCorner; ++where) {
    Parents::Neighbour some{where, neighbour_at(where, 0, {}).position, 0, 0, {}};
    for (Slot slot{0}; slot < kSlots && where != kHere; ++slot) {
      if (parents[std::size_t(where)][slot] == 0) continue;
      some.children |= std::uint64_t(1) << slot;
      some.any_parent |= parents[std::size_t(where)][slot];
      some.parents.push_back(parents[std::size_t(where)][slot]);
    }
    if (some.children != 0) all.neighbours.push_back(std::move(some));
  }
  return all;
}

// By the parity of the supercube's position, as in link_table().
const Parents& parents_of(Vertex position) {
  static const auto table = [] {
    std::array<Parents, 8> all;
    for (std::size_t parity = 0; parity < 8; ++parity) all[parity] = parents_of(link_table()[parity]);
    return all;
  }();
  return table[parity_of(position)];
}

}  // namespace

AncestorInserter::AncestorInserter(const SupercubeSet& set, SplitSet& split)
    : set_(set), split_(split), finders_(std::size_t(kMaxLevels), SetFinder(set)) {}

std::span<const SlotGroup> AncestorInserter::insert(const SlotGroup& group) {
  inserted_.clear();
  add({group.key, set_.occupancy()[group.supercube], group.brick, group.supercube, set_.first(group.brick, group.supercube)}, group.slots);
  return inserted_;
}

void AncestorInserter::take_back() {
  for (const SlotGroup& g : inserted_) split_.erase(g.brick, g.key, g.slots);
  inserted_.clear();
}

void AncestorInserter::add(const SetFinder::Found& here, std::uint64_t slots) {
  const int scale = scale_of_key(here.key);
  const Vertex position = position_of_key(here.key);
  const Parents& table = parents_of(position);
  // Most parents are split by now, so those of the diamonds are looked at only if there is one that is not.
  const std::uint64_t unsplit = here.occupancy & ~split_.slots(here.brick, here.key);
  if ((unsplit & ~slots & ~kSlotsOfClass[2]) != 0) {
    for (const std::size_t cls : {2, 1}) {
      for (const Slot slot : set_bits<Slot>(slots & kSlotsOfClass[cls])) slots |= table.here[slot] & unsplit;
    }
  }
  SetFinder& finder = finders_[std::size_t(scale)];
  for (const Parents::Neighbour& n : table.neighbours) {
    const std::uint64_t children = slots & n.children;
    if (children == 0) continue;
    const int up = n.where < kCoarser ? 0 : 1;
    const SupercubePlace place{scale + up, {(position.x >> up) + n.to.x, (position.y >> up) + n.to.y, (position.z >> up) + n.to.z}};
    if (!place.exists()) continue;
    finder.move_to(scale, position);  // a neighbour's ancestors may have moved it
    const SetFinder::Found found = finder.find(n.where, place);
    if ((found.occupancy & n.any_parent) == 0) continue;
    const std::uint64_t candidates = found.occupancy & n.any_parent & ~split_.slots(found.brick, found.key);
    if (candidates == 0) continue;
    std::uint64_t parents = 0;
    for (const Slot slot : set_bits<Slot>(children)) parents |= n.parents[std::size_t(count_below(n.children, slot))];
    parents &= candidates;
    if (parents != 0) add(found, parents);
  }
  split_.insert(here.brick, here.key, slots);
  inserted_.push_back({here.brick, here.supercube, here.key, slots});
}

}  // namespace intervale
