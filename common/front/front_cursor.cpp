// How a diamond finds what it is made of: its vertices' and edges' splits, in the supercubes around its own, which are looked for once each.
#include <algorithm>
#include <bit>
#include <cassert>

#include "common/front/front.h"

namespace intervale {
namespace {

// As std::atomic_ref, relaxed, which Emscripten's library lacks.
std::uint32_t load(const std::uint32_t& word) { return __atomic_load_n(&word, __ATOMIC_RELAXED); }
void store(std::uint32_t& word, std::uint32_t value) { __atomic_store_n(&word, value, __ATOMIC_RELAXED); }

}  // namespace

void Front::Cursor::move_to(int scale, Vertex position) {
  scale_ = scale;
  position_ = position;
  near_.fill(nullptr);
  links_ = &link_table()[unsigned(position.x & 1) | unsigned(position.y & 1) << 1 | unsigned(position.z & 1) << 2];
  interior_ = is_interior(front_.domain_, scale, position);
}

const Front::Block* Front::Cursor::resolve(std::uint8_t where) {
  static const Block nothing{};
  const Vertex p = position_;
  const Block* found = nullptr;
  if (where >= kFiner) {
    const SupercubePlace there = supercube_at(where, scale_, p);
    if ((there.scale | there.position.x | there.position.y | there.position.z) >= 0) found = front_.find_block(there.scale, there.position);
  } else if (where < kCorner) {
    const Block* const here = where == kHere || near_[kHere] == &nothing ? nullptr : near_[kHere] != nullptr ? near_[kHere] : resolve(kHere);
    if (here != nullptr && here != &nothing) {
      if (const std::uint32_t number = load(here->near[where]); number != 0) return near_[where] = &front_.blocks_[number - 1];
    }
    const SupercubePlace there = supercube_at(where, scale_, p);
    if ((there.position.x | there.position.y | there.position.z) >= 0) {
      const std::uint32_t number = front_.find_number(there.scale, there.position);
      if (number != kNone) {
        found = &front_.blocks_[number];
        if (here != nullptr && here != &nothing) store(here->near[where], number + 1);
      }
    }
  } else {
    const int w = where - kCorner;
    const Vertex v{(p.x + (w & 1)) << (scale_ + 2), (p.y + (w >> 1 & 1)) << (scale_ + 2), (p.z + (w >> 2)) << (scale_ + 2)};
    if ((v.x | v.y | v.z) == 0) {
      found = &front_.corner_;
      corner_slot_[where] = 0;
    } else {
      const Diamond d(v);
      found = front_.find_block(d.scale, {v.x >> (d.scale + 2), v.y >> (d.scale + 2), v.z >> (d.scale + 2)});
      corner_slot_[where] = kSlotOfType[d.type];
    }
  }
  near_[where] = found == nullptr ? &nothing : found;
  return near_[where];
}

// Vertices and sides.
bool Front::Cursor::gather(int slot) {
  slot_ = slot;
  const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
  if (scale_ >= front_.domain_.levels()) return false;
  diamond_ = Diamond(centre_of(scale_, position_, slot), scale_, kTypeOfSlot[slot]);
  if (interior_) {
    existing_ = {(1u << row.tets) - 1, (1u << row.vertices) - 1, (1u << row.edges) - 1, false};
  } else {
    existing_ = front_.existing(*diamond_);
    if (existing_.tets == 0) return false;
  }
  const Links& links = (*links_)[slot];
  context_.row = &row;
  context_.vertices = existing_.vertices;
  std::uint32_t sides = 0;
  for (int v = 0; v < row.vertices; ++v) {
    if (!(existing_.vertices >> v & 1)) continue;
    const Found found = at(links.vertex[v]);
    if (!(found.block->split >> found.slot & 1)) return false;
    split_[v] = found.block->of[found.slot];
    sides |= std::uint32_t(split_[v].side()) << (2 * v);
  }
  context_.sides = sides;
  return true;
}

// A quick no for most of those that are not ready.
bool Front::Cursor::parents_are_split(int slot) {
  if (!interior_) return true;  // some parents may not exist: gather() tells
  const Links& links = (*links_)[slot];
  const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
  for (int k = 0; k < row.parents; ++k) {
    const Found parent = at(links.vertex[links.parent[k]]);
    if (!(parent.block->split >> parent.slot & 1)) return false;
  }
  return true;
}

const DiamondContext& Front::Cursor::look_closer() {
  if (!context_.is_mixed()) {  // no edge is cut
    context_.cut = {};
    return context_;
  }
  const DiamondType& row = *context_.row;
  const Links& links = (*links_)[slot_];
  for (int e = 0; e < row.edges; ++e) {
    auto& cut = context_.cut[e];
    cut = {0, 0};
    if (!(existing_.edges >> e & 1)) continue;
    const Links::Edge edge = links.edge[e];
    const Split& owner = split_[edge.owner];
    const unsigned two = owner.bits >> (2 * edge.other) & 3;
    if (two == 0) continue;
    const std::uint8_t* q = front_.q_.data() + owner.cut(2 * edge.other);
    // Seen from the owner; the context wants it from the edge's first end.
    if (two & 1) cut[0] = std::uint16_t(2 * (*q++ ^ edge.flip) + 1);
    if (two & 2) cut[1] = std::uint16_t(2 * (*q ^ edge.flip) + 1);
  }
  return context_;
}

std::uint64_t Front::Cursor::split_slots() { return at({kHere, 0}).block->split; }

// Writes the diamond's split to where there is room for it.
void Front::Cursor::write(Block& block, Side side, std::span<const std::uint8_t> cuts, std::uint32_t first) {
  Split& s = block.of[slot_];
  s.first = first;
  s.bits = context_.cut_bits(side) | std::uint32_t(side) << kSideBit;
  std::copy(cuts.begin(), cuts.end(), front_.q_.begin() + first);
}

std::int64_t Front::Cursor::added_tets(const Split& split) const {
  if (!existing_.straddles && (split.bits & kCutBits) == 0) {  // all on one side: every tetrahedron inside becomes two
    return split.side() == Side::inside ? std::popcount(existing_.tets) : 0;
  }
  const std::uint32_t sides = context_.sides | std::uint32_t(split.side()) << (2 * kCentre);
  return std::int64_t(front_.count_halves(*diamond_, existing_, sides) - front_.count_tets(*diamond_, existing_, sides));
}

bool Front::Cursor::parents_are_shown() {
  const Links& links = (*links_)[slot_];
  for (int k = 0; k < diamond_type(kTypeOfSlot[slot_]).parents; ++k) {
    const int v = links.parent[k];
    if (!(existing_.vertices >> v & 1)) continue;
    const Found parent = at(links.vertex[v]);
    if (!(parent.block->shown >> parent.slot & 1)) return false;
  }
  return true;
}

void Front::Cursor::split(Side side, std::span<const std::uint8_t> cuts, std::uint64_t max_tets) {
  assert(int(cuts.size()) == context_.count_cuts(side).all && "the caller counted");
  Block& block = front_.obtain_block(scale_, position_);
  near_[kHere] = &block;
  // Room that it had before is used again if it is the same split that comes back.
  const Split before = block.of[slot_];
  std::uint32_t first = before.first;
  if (before.bits != (context_.cut_bits(side) | std::uint32_t(side) << kSideBit) || before.bits == 0) {
    first = std::uint32_t(front_.q_.size());
    front_.q_.resize(front_.q_.size() + cuts.size() + (side == Side::inside ? 1 : 0));
  }
  write(block, side, cuts, first);
  const bool all_shown = front_.shown_count_ == front_.split_count_;
  block.split |= std::uint64_t(1) << slot_;
  ++front_.split_count_;
  if (!all_shown) return;
  const std::uint64_t tets = front_.tet_count_ + std::uint64_t(added_tets(block.of[slot_]));
  if (tets > max_tets) return;
  front_.tet_count_ = tets;
  block.shown |= std::uint64_t(1) << slot_;
  ++front_.shown_count_;
}

}  // namespace intervale
