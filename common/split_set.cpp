#include "common/split_set.h"

#include <algorithm>
#include <bit>

namespace intervale {

std::uint64_t SplitSet::count() const {
  std::uint64_t n = 0;
  for (std::uint64_t w : words_) n += std::uint64_t(std::popcount(w));
  return n;
}

std::uint64_t SplitSet::slots(const SupercubeSet& set, std::uint32_t brick, std::uint32_t supercube) const {
  // The supercube's bits stand together, in at most two words.
  const UpdateIndex first = set.first(brick, supercube);
  const std::uint64_t occupancy = set.occupancy()[supercube];
  std::uint64_t bits = some(first, unsigned(std::popcount(occupancy)));
  std::uint64_t slots = 0;
  for (std::uint64_t left = occupancy; left != 0; left &= left - 1, bits >>= 1) slots |= left & (~left + 1) & (~(bits & 1) + 1);
  return slots;
}

std::vector<SlotGroup> SplitSet::groups(const SupercubeSet& set) const {
  std::vector<SlotGroup> groups;
  const auto bricks = set.bricks();
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const UpdateIndex first = bricks[b].first, end = b + 1 < bricks.size() ? bricks[b + 1].first : set.size();
    const auto from = words_.begin() + first / 64, to = words_.begin() + (end + 63) / 64;
    if (std::all_of(from, to, [](std::uint64_t w) { return w == 0; })) continue;
    set.for_each_supercube(b, [&](std::uint32_t s, SupercubeKey key) {
      if (const std::uint64_t some = slots(set, b, s)) groups.push_back({b, s, key, some});
    });
  }
  return groups;
}

void Readiness::move_to(SupercubeKey key) {
  scale_ = scale_of_key(key);
  position_ = position_of_key(key);
  links_ = &link_table()[unsigned(position_.x & 1) | unsigned(position_.y & 1) << 1 | unsigned(position_.z & 1) << 2];
  known_ = 0;
}

bool Readiness::is_split(Link link) {
  std::uint64_t& slots = slots_[link.where];
  if (!(known_ >> link.where & 1)) {
    known_ |= std::uint64_t(1) << link.where;
    const auto [scale, position] = supercube_at(link.where, scale_, position_);
    slots = 0;
    if (scale == domain_.levels()) {
      slots = ~std::uint64_t(0);  // the corners of the domain
    } else if ((position.x | position.y | position.z) >= 0) {
      if (const auto found = set_.find_supercube(scale, position)) slots = split_.slots(set_, found->brick, found->supercube);
    }
  }
  return (slots >> link.slot & 1) != 0;
}

std::uint64_t Readiness::ready() {
  std::uint64_t ready = 0;
  if (scale_ >= domain_.levels()) return ready;
  const bool interior = is_interior(domain_, scale_, position_);
  for (int slot = 0; slot < kSlots; ++slot) {
    const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
    std::uint32_t vertices = ~std::uint32_t(0);
    if (!interior) {
      const Diamond d(centre_of(scale_, position_, slot));
      const unsigned tets = domain_.tets(d);
      if (tets == 0 || domain_.is_idle(d)) continue;
      vertices = Domain::vertices(row, tets);
    }
    const Links& links = (*links_)[slot];
    bool all = true;
    for (int k = 0; k < row.parents && all; ++k) {
      const int v = links.parent[k];
      all = !(vertices >> v & 1) || is_split(links.vertex[v]);
    }
    ready |= std::uint64_t(all) << slot;
  }
  return ready;
}

}  // namespace intervale
