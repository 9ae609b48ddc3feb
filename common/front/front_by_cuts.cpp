// Splits by cuts.
#include <algorithm>
#include <cassert>

#include "common/front/corners.h"
#include "common/front/front.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

constexpr std::uint64_t bit(Slot slot) { return std::uint64_t(1) << slot; }

}  // namespace

Front::Front(const Grid& grid, const RootPatch& root_patch) : state_(grid) { place_corners(state_, root_patch); }

DiamondContext Front::context(Handle handle) const {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  return cursor.gather_cuts();
}

void Front::split(Handle handle, Side side, std::span<const std::uint8_t> cuts) {
  FrontCursor cursor(state_);
  cursor.move_to(handle.supercube);
  cursor.gather(handle.slot);
  split(cursor, side, cuts);
}

void Front::split(FrontCursor& at, Side side, std::span<const std::uint8_t> cuts, std::uint64_t max_tets) {
  assert(int(cuts.size()) == at.context().count_cuts(side) && "the caller counted");
  Block& block = at.obtain_here(state_);
  block.set_side(at.slot(), side);
  const std::uint32_t bits = at.context().cut_bits(side) | std::uint32_t(side) << Split::kSideBit;
  Split s = block.split_at(at.slot());
  if (!block.placed.has(at.slot()) || s.bits != bits) {  // else the split that was merged comes back, and its points are still there
    s = {bits, state_.points};
    state_.points += s.points();
    state_.q.resize(state_.points);
    block.place(at.slot(), s);
  }
  std::copy(cuts.begin(), cuts.end(), state_.q.begin() + s.first);
  const bool all_shown = state_.shown_count == state_.split_count;
  block.split |= bit(at.slot());
  ++state_.split_count;
  if (!all_shown) return;
  const std::uint64_t tets = state_.tet_count + std::uint64_t(at.added_tets(s));
  if (tets > max_tets) return;
  state_.tet_count = tets;
  block.shown |= bit(at.slot());
  ++state_.shown_count;
}

}  // namespace intervale
