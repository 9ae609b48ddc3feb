#include "common/front/shown_splits.h"

#include <algorithm>
#include <bit>

#include "common/front/diamond_parts.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

}  // namespace

bool counts(const KeySides& sides, const KeySpan& around, Side centre, Refine refine) {
  const Side low = sides.side(around.least);
  return low != sides.side(around.greatest) || centre != low || (refine == Refine::uniform && low == Side::inside);
}

bool counts(const DiamondContext& context, Side centre, Refine refine) {
  if (context.is_mixed()) return true;
  const Side all = context.sides == 0 ? Side::below : context.sides == context.pairs() ? Side::inside : Side::above;
  return centre != all || (refine == Refine::uniform && all == Side::inside);
}

void widen_bounds(const KeySpan& around, ValueKey centre, Block& block) {
  block.least = std::min({block.least, around.least, centre});
  block.greatest = std::max({block.greatest, around.greatest, centre});
}

// Adds the parents by place that are split and shown, or hidden.
void ShownSplits::add_parents(FrontCursor& at, bool shown, std::vector<Place>& places) {
  const Links& links = at.links();
  for (int k = 0; k < at.context().row->parents; ++k) {
    const FrontCursor::Neighbour parent = at.at(links.vertex[links.parent[std::size_t(k)]]);
    if (parent.is_shown() != shown || !parent.is_split() || state_.is_root_block(parent.block)) continue;
    if (places.empty()) places.reserve(16);
    places.push_back({&state_.obtain_block(parent.block.scale, parent.block.position), parent.slot});
  }
}

void ShownSplits::move_to(const Place& place) {
  if (!cursor_) cursor_.emplace(state_);
  if (place.block != at_) cursor_->move_to(place.block->scale, place.block->position);
  at_ = place.block;
  if (!place.block->is_counting(place.slot)) {
    cursor_->gather_one_sided(place.slot);
  } else {
    cursor_->gather_sides(place.slot);
  }
}

// Gives points to the split of the diamond that the cursor found last. Returns how many tetrahedra it adds to the mesh.
// If it had points before, and its vertices have the same sides, those come back.
std::int64_t ShownSplits::place_points(FrontCursor& at, const Place& place) {
  Block& block = *place.block;
  const Side side = block.side(place.slot);
  const std::uint32_t bits = at.context().cut_bits(side) | std::uint32_t(side) << Split::kSideBit;
  Split split = block.split_at(place.slot);
  if (!block.placed.has(place.slot) || split.bits != bits) {
    split = {bits, PointId(state_.points)};
    state_.points += split.points();
    block.place(place.slot, split);
  }
  return at.added_tets(split);
}

bool ShownSplits::show(FrontCursor& at, std::uint64_t max_tets) {
  const Place own{&at.obtain_here(state_), at.slot()};
  std::vector<Place> ancestors;
  // Marks ancestors as shown when they are found, so that each is found once.
  const auto add_hidden_parents = [&](FrontCursor& of) {
    const std::size_t before = ancestors.size();
    add_parents(of, false, ancestors);
    for (std::size_t k = before; k < ancestors.size(); ++k) ancestors[k].block->shown |= bit(ancestors[k].slot);
  };
  std::uint64_t tets = state_.tet_count + std::uint64_t(place_points(at, own));
  add_hidden_parents(at);
  for (std::size_t i = 0; i < ancestors.size(); ++i) {
    const Place place = ancestors[i];
    move_to(place);
    tets += std::uint64_t(place_points(*cursor_, place));
    add_hidden_parents(*cursor_);
  }
  if (tets > max_tets) {
    for (const Place& place : ancestors) place.block->shown &= ~bit(place.slot);
    return false;
  }
  own.block->shown |= bit(own.slot);
  state_.tet_count = tets;
  state_.shown_count += ancestors.size() + 1;
  state_.values.withheld -= own.block->is_counting(own.slot);
  for (const Place& place : ancestors) state_.values.withheld -= place.block->is_counting(place.slot);
  return true;
}

void ShownSplits::hide_one(FrontCursor& at) {
  Block& block = at.obtain_here(state_);
  state_.tet_count -= std::uint64_t(at.added_tets(block.split_at(at.slot())));
  block.shown &= ~bit(at.slot());
  --state_.shown_count;
  state_.values.withheld += block.is_counting(at.slot());
}

void ShownSplits::hide(FrontCursor& at) {
  std::vector<Place> places;
  hide_one(at);
  add_parents(at, true, places);
  while (!places.empty()) {
    const Place place = places.back();
    places.pop_back();
    // A parent of several that were hidden may be here more than once.
    if (!place.block->is_shown(place.slot) || place.block->is_counting(place.slot)) continue;
    move_to(place);
    if (cursor_->has_shown_child()) continue;
    hide_one(*cursor_);
    add_parents(*cursor_, true, places);
  }
}

}  // namespace intervale
