#include "common/diamond/split_set.h"

#include <algorithm>
#include <bit>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace intervale {

namespace {

// Moves the lowest bits of `bits`, in their order, to the positions of the ones of `mask`.
std::uint64_t deposit_portably(std::uint64_t bits, std::uint64_t mask) {
  std::uint64_t result = 0;
  for (std::uint64_t left = mask; left != 0; left &= left - 1, bits >>= 1) result |= left & (~left + 1) & (~(bits & 1) + 1);
  return result;
}
// The inverse: moves the bits at the ones of `mask` to the lowest positions, in their order.
std::uint64_t extract_portably(std::uint64_t bits, std::uint64_t mask) {
  std::uint64_t result = 0;
  for (std::uint64_t left = mask, to = 1; left != 0; left &= left - 1, to <<= 1) result |= (bits >> std::countr_zero(left) & 1) != 0 ? to : 0;
  return result;
}
#if defined(__x86_64__)
__attribute__((target("bmi2"))) std::uint64_t deposit_bmi2(std::uint64_t bits, std::uint64_t mask) { return _pdep_u64(bits, mask); }
__attribute__((target("bmi2"))) std::uint64_t extract_bmi2(std::uint64_t bits, std::uint64_t mask) { return _pext_u64(bits, mask); }
const bool kHasBmi2 = __builtin_cpu_supports("bmi2") != 0;
std::uint64_t deposit(std::uint64_t bits, std::uint64_t mask) { return kHasBmi2 ? deposit_bmi2(bits, mask) : deposit_portably(bits, mask); }
std::uint64_t extract(std::uint64_t bits, std::uint64_t mask) { return kHasBmi2 ? extract_bmi2(bits, mask) : extract_portably(bits, mask); }
#else
std::uint64_t deposit(std::uint64_t bits, std::uint64_t mask) { return deposit_portably(bits, mask); }
std::uint64_t extract(std::uint64_t bits, std::uint64_t mask) { return extract_portably(bits, mask); }
#endif

}  // namespace

std::uint64_t SplitSet::count() const {
  std::uint64_t n = 0;
  for (std::uint64_t w : words_) n += std::uint64_t(std::popcount(w));
  return n;
}

std::uint64_t SplitSet::slots(UpdateIndex first, std::uint64_t occupancy) const {
  return deposit(some(first, unsigned(std::popcount(occupancy))), occupancy);
}

void SplitSet::insert(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots) {
  const std::uint64_t bits = extract(slots, occupancy);
  const unsigned shift = first % 64;
  words_[first / 64] |= bits << shift;
  if (shift != 0 && bits >> (64 - shift) != 0) words_[first / 64 + 1] |= bits >> (64 - shift);
}

void SplitSet::erase(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots) {
  const std::uint64_t bits = extract(slots, occupancy);
  const unsigned shift = first % 64;
  words_[first / 64] &= ~(bits << shift);
  if (shift != 0 && bits >> (64 - shift) != 0) words_[first / 64 + 1] &= ~(bits >> (64 - shift));
}

std::vector<SlotGroup> SplitSet::groups(const SupercubeSet& set) const {
  std::vector<SlotGroup> groups;
  const auto bricks = set.bricks();
  for (BrickIndex b{0}; b < bricks.size(); ++b) {
    const std::uint32_t first = bricks[b].first, end = b + 1 < bricks.size() ? bricks[b + 1].first : set.size();
    const auto from = words_.begin() + first / 64, to = words_.begin() + (end + 63) / 64;
    if (std::all_of(from, to, [](std::uint64_t w) { return w == 0; })) continue;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      if (const std::uint64_t some = slots(set.first(b, s), set.occupancy()[s])) groups.push_back({b, s, key, some});
    });
  }
  return groups;
}

namespace {

// The parents that one neighbour holds of the diamonds of a supercube inside the box.
struct Parents {
  int where = 0;
  std::uint64_t parents = 0;             // slots in the neighbour
  std::uint64_t all = 0;                 // slots here of diamonds with any of those parents
  std::vector<std::uint64_t> by_parent;  // slots here of its children, for each of `parents`
};

std::vector<Parents> parents_of(const std::array<Links, kSlots>& links) {
  std::array<std::array<std::uint64_t, 64>, kCorner> children{};
  for (Slot slot{0}; slot < kSlots; ++slot) {
    for (int k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
      const Link link = links[slot].vertex[links[slot].parent[k]];
      children[link.where][link.slot] |= std::uint64_t(1) << slot;
    }
  }
  std::vector<Parents> by_neighbour;
  for (int where = 0; where < kCorner; ++where) {
    Parents some;
    some.where = where;
    for (Slot slot{0}; slot < kSlots; ++slot) {
      if (children[where][slot] == 0) continue;
      some.parents |= std::uint64_t(1) << slot;
      some.all |= children[where][slot];
      some.by_parent.push_back(children[where][slot]);
    }
    if (some.parents != 0) by_neighbour.push_back(std::move(some));
  }
  // Those with the most children come first: where their parents are not split, the other neighbours are not looked up.
  std::stable_sort(by_neighbour.begin(), by_neighbour.end(),
                   [](const Parents& a, const Parents& b) { return std::popcount(a.all) > std::popcount(b.all); });
  return by_neighbour;
}

// By the parity of the supercube's position, as in link_table().
const std::vector<Parents>& parents_of(Vertex position) {
  static const auto table = [] {
    std::array<std::vector<Parents>, 8> all;
    for (std::size_t parity = 0; parity < 8; ++parity) all[parity] = parents_of(link_table()[parity]);
    return all;
  }();
  return table[parity_of(position)];
}

}  // namespace

void SplittableSlots::move_to(SupercubeKey key) {
  around_.move_to(key);
  known_ = 0;
}

std::uint64_t SplittableSlots::split_slots(int where) {
  std::uint64_t& slots = split_slots_[std::size_t(where)];
  if (!(known_ >> where & 1)) {
    known_ |= std::uint64_t(1) << where;
    if (where >= kCoarser && around_.scale() + 1 == domain_.levels()) {
      slots = ~std::uint64_t(0);  // the corners of the domain
    } else {
      const SetFinder::Found& found = around_.at(where);
      slots = found.occupancy == 0 ? 0 : split_.slots(found.first, found.occupancy);
    }
  }
  return slots;
}

std::uint64_t SplittableSlots::slots_inside() {
  std::uint64_t ready = (std::uint64_t(1) << kSlots) - 1;
  for (const Parents& some : parents_of(around_.position())) {
    if ((some.all & ready) == 0) continue;
    for (const Slot missing : set_bits<Slot>(some.parents & ~split_slots(some.where))) {
      ready &= ~some.by_parent[std::size_t(count_below(some.parents, missing))];
    }
  }
  return ready;
}

std::uint64_t SplittableSlots::slots() {
  const int scale = around_.scale();
  if (scale >= domain_.levels()) return 0;
  if (is_interior(domain_, scale, around_.position())) return slots_inside();
  std::uint64_t ready = 0;
  for (Slot slot{0}; slot < kSlots; ++slot) {
    const Diamond d(centre_of(scale, around_.position(), slot));
    const unsigned tets = domain_.tets(d);
    if (tets == 0 || domain_.is_noop(d)) continue;
    const DiamondType& row = *d.row;
    const std::uint32_t vertices = Domain::vertices(row, tets);
    const Links& links = around_.links(slot);
    bool all = true;
    for (int k = 0; k < row.parents && all; ++k) {
      const int v = links.parent[k];
      all = !(vertices >> v & 1) || (split_slots(links.vertex[v].where) >> links.vertex[v].slot & 1) != 0;
    }
    ready |= std::uint64_t(all) << slot;
  }
  return ready;
}

}  // namespace intervale
