#include "common/front/front_cursor.h"

#include <algorithm>
#include <bit>

#include "common/diamond/parent_table.h"
#include "common/util/bits.h"

namespace intervale {

template <class State>
typename BlockFinderOf<State>::Found BlockFinderOf<State>::none() {
  static FrontState::Block block{};  // nobody changes it: it has no splits
  return &block;
}

template <class State>
typename BlockFinderOf<State>::Found BlockFinderOf<State>::find(int, const SupercubePlace& place) const {
  if (place.scale == kOriginScale) return &state_.origin;
  const std::uint32_t number = state_.find_number(place.scale, place.position);
  return number == FrontState::kNone ? none() : &state_.blocks[number];
}

template class BlockFinderOf<const FrontState>;
template class BlockFinderOf<FrontState>;

void FrontCursor::move_to(int scale, Vertex position) {
  neighbours_.move_to(scale, position);
  here_ = state_.find_number(scale, position);
  if (here_ != FrontState::kNone) neighbours_.set_here(&state_.blocks[here_]);
  is_interior_ = intervale::is_interior(state_.domain, scale, position);
}

void FrontCursor::move_to(const Diamond& d) {
  const int up = d.scale + 2;
  move_to(d.scale, {d.centre.x >> up, d.centre.y >> up, d.centre.z >> up});
}

bool FrontCursor::gather_parts(Slot slot) {
  slot_ = slot;
  has_keys_ = has_sides_ = false;
  const DiamondType& row = diamond_type(kTypeOfSlot[std::size_t(slot)]);
  if (scale() >= state_.domain.levels()) return false;
  parts_ = is_interior_ ? all_parts(row) : parts_of(state_.domain, diamond());
  if (parts_.tets == 0) return false;
  context_.row = &row;
  context_.vertices = parts_.vertices;
  return true;
}

void FrontCursor::gather_own(Slot slot) {
  gather_parts(slot);
  context_.sides = here().split_at(slot).vertex_sides(context_.pairs());
  has_sides_ = true;
}

void FrontCursor::gather_one_sided(Slot slot) {
  gather_parts(slot);
  context_.sides = context_.pairs() * std::uint32_t(here().side(slot));
  has_sides_ = true;
}

bool FrontCursor::gather_sides(Slot slot) {
  if (!gather_parts(slot)) return false;
  const Links& links = neighbours_.links(slot);
  std::uint32_t sides = 0;
  for (int v = 0; v < context_.row->vertices; ++v) {
    if (!(parts_.vertices >> v & 1)) continue;
    const Neighbour vertex = at(links.vertex[std::size_t(v)]);
    if (!vertex.is_split()) return false;
    sides |= std::uint32_t(vertex.block.side(vertex.slot)) << (2 * v);
  }
  context_.sides = sides;
  has_sides_ = true;
  return true;
}

bool FrontCursor::gather_keys(Slot slot) { return gather_parts(slot) && load_keys(); }

// False if a vertex's diamond is not split.
bool FrontCursor::load_keys() {
  const Links& links = this->links();
  const int vertices = context_.row->vertices;
  const std::uint32_t exist = parts_.vertices;
  KeySpan span{kNoKey, 0};
  for (int v = 0; v < vertices; ++v) {
    if (!(exist >> v & 1)) {
      keys_[std::size_t(v)] = kNoKey;
      continue;
    }
    const Neighbour vertex = at(links.vertex[std::size_t(v)]);
    if (!vertex.is_split()) return false;
    const ValueKey key = vertex.block.key[std::size_t(vertex.slot)];
    keys_[std::size_t(v)] = key;
    span.add(key);
  }
  key_span_ = span;
  has_keys_ = true;
  return true;
}

const DiamondContext& FrontCursor::context_with_sides() {
  if (has_sides_) return context_;
  const KeySides sides = state_.values.sides;
  const int vertices = context_.row->vertices;
  std::uint32_t found = 0;
  for (int v = 0; v < vertices; ++v) found |= std::uint32_t(sides.side(keys_[std::size_t(v)])) << (2 * v);
  context_.sides = found & 3 * context_.pairs();
  has_sides_ = true;
  return context_;
}

// Rejects most of the diamonds that cannot be split, at a fraction of the cost of looking at all vertices. At the
// border some parents may not exist, of all but the root not all: the vertices decide.
bool FrontCursor::parents_are_split(Slot slot) {
  const Links& links = neighbours_.links(slot);
  const int parents = diamond_type(kTypeOfSlot[std::size_t(slot)]).parents;
  for (int k = 0; k < parents; ++k) {
    if (at(links.vertex[links.parent[std::size_t(k)]]).is_split() != is_interior_) return !is_interior_;
  }
  return is_interior_ || scale() == state_.domain.levels() - 1;
}

std::uint64_t FrontCursor::may_be_splittable(std::uint64_t slots) {
  if (!is_interior_ || slots == 0) return slots;
  for (const Slot slot : set_bits<Slot>(slots & kSlotsOfClass[0])) {
    if (!parents_are_split(slot)) slots &= ~(std::uint64_t(1) << slot);
  }
  if ((slots & ~kSlotsOfClass[0]) == 0) return slots;
  ParentTable::Words split;
  for (std::size_t k = 0; k < split.size(); ++k) split[k] = neighbours_.at(ParentTable::kNeighbours[k])->split;
  return slots & ~parent_table().lacking(split);
}

bool FrontCursor::parents_are_shown() {
  const Links& links = this->links();
  for (int k = 0; k < context_.row->parents; ++k) {
    const int v = links.parent[std::size_t(k)];
    if ((parts_.vertices >> v & 1) && !at(links.vertex[std::size_t(v)]).is_shown()) return false;
  }
  return true;
}

bool FrontCursor::has_split_child() {
  const std::span<const Link> children = neighbours_.children(slot_);
  for (std::size_t k = 0; k < children.size(); ++k) {
    const Neighbour child = at(children[k]);
    if (!child.is_split()) continue;
    for (const Duet::Half& half : context_.row->child[k].half) {
      if ((parts_.tets >> half.tet & 1) && half_exists(state_.domain, diamond(), half.tet, half.end)) return true;
    }
  }
  return false;
}

bool FrontCursor::has_shown_child() {
  const std::span<const Link> children = neighbours_.children(slot_);
  return std::any_of(children.begin(), children.end(), [this](Link child) { return at(child).is_shown(); });
}

std::int64_t FrontCursor::added_tets(const Split& split) const {
  if (!parts_.straddles && split.cut_bits() == 0) {  // all on one side: every tetrahedron inside becomes two
    return split.side() == Side::inside ? std::popcount(parts_.tets) : 0;
  }
  return count_added(state_.domain, diamond(), parts_, context_.sides | std::uint32_t(split.side()) << (2 * kCentre));
}

}  // namespace intervale
