#include "common/front/front.h"

#include <algorithm>
#include <cassert>

#include "common/diamond/supercube_neighbours.h"
#include "common/front/corners.h"
#include "common/front/shown_splits.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;

// Removes a split that is not shown.
void remove_split(FrontState& state, Block& block, Slot slot) {
  state.values.withheld -= block.is_counting(slot);
  block.counts &= ~bit(slot);
  block.split &= ~bit(slot);
  --state.split_count;
}

}  // namespace

Front::Front(const Grid& grid, const ValueFormat& format, const std::array<ValueKey, kRootVertices>& corners, const Range& range, Refine refine)
    : state_(grid, FrontValues(format, range, refine)) {
  set_corner_keys(state_, corners);
  place_corners(state_);
}

std::optional<Front::Handle> Front::find(Vertex centre) const {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= state_.domain.levels()) return {};
  const std::int32_t most = 1 << state_.domain.levels();
  if (centre.x > most || centre.y > most || centre.z > most) return {};
  const Diamond d(centre);
  FrontCursor cursor(state_);
  cursor.move_to(d);
  const Slot slot = kSlotOfType[d.type];
  if (!cursor.find(slot)) return {};
  return Handle{supercube_key(d.scale, cursor.position()), slot};
}

void Front::split(Handle handle, ValueKey key) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather_keys(handle.slot);
  split(cursor, key);
}

void Front::split(FrontCursor& at, ValueKey key, std::uint64_t max_tets) {
  FrontValues& values = state_.values;
  assert(key <= values.format.last && "the caller checked it");
  Block& block = at.obtain_here(state_);
  const Side side = values.sides.side(key);
  const bool is_counting = counts(values.sides, at.key_span(), side, values.refine), was_complete = values.is_complete();
  block.key.set(at.slot(), key, values.format.last);
  widen_bounds(at.key_span(), key, block);
  block.set_side(at.slot(), side);
  block.split |= bit(at.slot());
  ++state_.split_count;
  if (is_counting) {
    block.counts |= bit(at.slot());
    ++values.withheld;
  }
  // Only at the border of the box may a child's split come before its parent's, which then belongs into the mesh
  // anyway.
  const bool has_shown_child = !at.is_interior() && at.has_shown_child();
  if (!is_counting && !has_shown_child) return;
  at.context_with_sides();
  const bool is_shown = (was_complete || !is_counting) && ShownSplits(state_).show(at, max_tets);
  if (!is_shown && !is_counting) values.is_limited = true;
}

bool Front::merge(Vertex centre) {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= state_.domain.levels()) return false;
  const Diamond d(centre);
  FrontCursor cursor(state_);
  cursor.move_to(d);
  if (!cursor.gather_sides(kSlotOfType[d.type]) || !cursor.is_split() || cursor.has_split_child()) return false;
  if (cursor.is_shown()) ShownSplits(state_).hide(cursor);
  remove_split(state_, state_.obtain_block(cursor.scale(), cursor.position()), cursor.slot());
  return true;
}

bool Front::hide(Handle handle) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather_sides(handle.slot) || !cursor.is_shown() || cursor.has_shown_child()) return false;
  ShownSplits(state_).hide(cursor);
  return true;
}

bool Front::show(Handle handle, std::uint64_t max_tets) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather_sides(handle.slot) || !cursor.is_split() || cursor.is_shown()) return false;
  return cursor.here().is_counting(handle.slot) && ShownSplits(state_).show(cursor, max_tets);
}

void Front::forget(std::span<const SlotGroup> groups) {
  SupercubeNeighbours<BlockFinder> neighbours(state_);
  const auto split_slots = [this](const Block* block) { return state_.is_root_block(*block) ? 0 : block->split; };
  merge_finest_first(groups, neighbours, split_slots, [this](const SlotGroup& group, Slot slot) {
    hide(Handle{group.key, slot});
    remove_split(state_, state_.obtain_block(scale_of_key(group.key), position_of_key(group.key)), slot);
  });
  state_.pack();
}

std::vector<SlotGroup> Front::splits() const {
  std::vector<SlotGroup> splits;
  for (const Block& b : state_.blocks) {
    if (!state_.is_root_block(b) && b.split != 0) splits.push_back({{}, {}, supercube_key(b.scale, b.position), b.split});
  }
  std::sort(splits.begin(), splits.end(), [](const SlotGroup& a, const SlotGroup& b) { return a.key < b.key; });
  return splits;
}

std::uint64_t Front::shown_slots(SupercubeKey supercube) const {
  const Block* const block = state_.find_block(scale_of_key(supercube), position_of_key(supercube));
  return block == nullptr ? 0 : block->shown;
}

bool Front::is_hidden(Handle handle) const {
  const Block* const block = state_.find_block(scale_of_key(handle.supercube), position_of_key(handle.supercube));
  return block != nullptr && ((block->split & ~block->shown) >> handle.slot & 1) != 0;
}

}  // namespace intervale
