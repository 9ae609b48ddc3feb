#include "common/front/front.h"

#include <algorithm>

#include "common/diamond/supercube_neighbours.h"
#include "common/front/shown_splits.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;

constexpr std::uint64_t bit(Slot slot) { return std::uint64_t(1) << slot; }

// Hides the split of the diamond that the cursor found last; it is shown, and no child's is.
void hide_split(FrontState& state, FrontCursor& at) {
  if (state.values) {
    ShownSplits(state).hide(at);
    return;
  }
  Block& block = state.obtain_block(at.scale(), at.position());
  state.tet_count -= std::uint64_t(at.added_tets(block.split_at(at.slot())));
  block.shown &= ~bit(at.slot());
  --state.shown_count;
}

// Removes a split that is not shown.
void remove_split(FrontState& state, Block& block, Slot slot) {
  if (state.values) state.values->withheld -= block.is_counting(slot);
  block.counts &= ~bit(slot);
  block.split &= ~bit(slot);
  --state.split_count;
}

}  // namespace

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

bool Front::merge(Vertex centre) {
  if ((centre.x | centre.y | centre.z) <= 0 || scale_of(centre) >= state_.domain.levels()) return false;
  const Diamond d(centre);
  FrontCursor cursor(state_);
  cursor.move_to(d);
  if (!cursor.gather_sides(kSlotOfType[d.type]) || !cursor.is_split() || cursor.has_child_in(&Block::split)) return false;
  if (cursor.is_shown()) hide_split(state_, cursor);
  remove_split(state_, state_.obtain_block(cursor.scale(), cursor.position()), cursor.slot());
  return true;
}

bool Front::hide(Handle handle) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather_sides(handle.slot) || !cursor.is_shown()) return false;
  if (state_.values ? cursor.has_shown_child() : cursor.has_child_in(&Block::shown)) return false;
  hide_split(state_, cursor);
  return true;
}

bool Front::show(Handle handle, std::uint64_t max_tets) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  if (!cursor.gather_sides(handle.slot) || !cursor.is_split() || cursor.is_shown()) return false;
  if (state_.values) return cursor.here().is_counting(handle.slot) && ShownSplits(state_).show(cursor, max_tets);
  if (!cursor.parents_are_shown()) return false;
  Block& block = state_.obtain_block(cursor.scale(), cursor.position());
  const std::uint64_t tets = state_.tet_count + std::uint64_t(cursor.added_tets(block.split_at(handle.slot)));
  if (tets > max_tets) return false;
  state_.tet_count = tets;
  block.shown |= bit(handle.slot);
  ++state_.shown_count;
  return true;
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
