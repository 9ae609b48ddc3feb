// Splits by values.
#include <cassert>

#include "common/front/corners.h"
#include "common/front/front.h"
#include "common/front/shown_splits.h"

namespace intervale {

Front::Front(const Grid& grid, const ValueFormat& format, const std::array<ValueKey, kRootVertices>& corners, const Range& range, Refine refine)
    : state_(grid) {
  state_.values.emplace(format, range, refine);
  set_corner_keys(state_, corners);
  place_corners(state_, root_patch_of(state_));
}

void Front::split(Handle handle, ValueKey key) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather_sides(handle.slot);
  split(cursor, key);
}

void Front::split(FrontCursor& at, ValueKey key, std::uint64_t max_tets) {
  FrontValues& values = *state_.values;
  assert(key <= values.format.last && "the caller checked it");
  FrontState::Block& block = at.obtain_here(state_);
  const std::uint64_t bit = std::uint64_t(1) << at.slot();
  const Side side = values.sides.side(key);
  const bool is_counting = counts(at.context_with_sides(), side, values.refine), was_complete = values.is_complete();
  block.key.set(at.slot(), key, values.format.last);
  widen_bounds(at, block);
  block.set_side(at.slot(), side);
  block.split |= bit;
  ++state_.split_count;
  if (is_counting) {
    block.counts |= bit;
    ++values.withheld;
  }
  // Only at the border of the box may a child's split come before its parent's, which then belongs into the mesh anyway.
  const bool has_shown_child = !at.is_interior() && at.has_shown_child();
  if (!is_counting && !has_shown_child) return;
  const bool is_shown = (was_complete || !is_counting) && ShownSplits(state_).show(at, max_tets);
  if (!is_shown && !is_counting) values.is_limited = true;
}

}  // namespace intervale
