#include <algorithm>
#include <string>
#include <vector>

#include "common/front/front.h"
#include "common/front/shown_splits.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

struct Counts {
  std::uint64_t splits = 0, shown = 0, tets = 0, withheld = 0;
};
using Wrong = std::optional<std::string>;

// The cuts of the split that the cursor found last.
Wrong validate_cuts(const FrontState& state, const FrontCursor& cursor, const Split& split) {
  if (unsigned(split.side()) > 2) return "a side is not below, inside or above";
  if (split.cut_bits() != cursor.context().cut_bits(split.side())) return "the cuts do not fit the sides";
  if (std::size_t(split.first) + split.points() > state.points) return "a point is out of range";
  return {};
}

// What follows from the values of the split that the cursor found last.
Wrong validate_values(const FrontState& state, FrontCursor& cursor, const Block& block) {
  const FrontValues& values = state.values;
  const Slot slot = cursor.slot();
  const Side side = side_of(values.format.value(block.key[slot]), values.range);
  const bool is_counting = counts(cursor.context(), side, values.refine), is_shown = block.is_shown(slot), has_child = cursor.has_shown_child();
  if (block.side(slot) != side) return "a side is not that of the value";
  if (block.is_counting(slot) != is_counting) return "whether a diamond counts is wrong";
  if (is_shown && !is_counting && !has_child) return "a split is shown that does not count, without a shown child";
  if (values.is_complete() && (is_counting || has_child) != is_shown) return "what is shown is not what the rule says";
  if (!is_shown) return {};
  const Split split = block.split_at(slot);
  if (split.points() != 0 && !block.placed.has(slot)) return "a shown split has no points";
  if (split.side() != side) return "the side of a split is wrong";
  return {};
}

// The first violation in one supercube, and what it adds to the counts.
Wrong validate_block(const FrontState& state, const Block& block, FrontCursor& cursor, Counts& counts) {
  if (state.find_block(block.scale, block.position) != &block) return "a supercube is not found under its scale and position";
  if ((block.shown & ~block.split) != 0) return "a diamond is shown as split, but is not split";
  if ((block.counts & ~block.split) != 0) return "a diamond counts, but is not split";
  if (state.is_root_block(block)) return {};
  cursor.move_to(block.scale, block.position);
  for (const Slot slot : set_bits<Slot>(block.split)) {
    const Vertex c = centre_of(block.scale, block.position, slot);
    const auto where = " at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")";
    const Split split = block.split_at(slot);
    if (!cursor.gather_sides(slot)) return "a diamond is split before its parents" + where;
    if (block.is_shown(slot)) {
      if (const Wrong wrong = validate_cuts(state, cursor, split)) return *wrong + where;
    }
    if (const Wrong wrong = validate_values(state, cursor, block)) return *wrong + where;
    ++counts.splits;
    if (!block.is_shown(slot)) {
      counts.withheld += block.is_counting(slot);
      continue;
    }
    ++counts.shown;
    if (!cursor.parents_are_shown()) return "a split is shown, but a parent's is hidden" + where;
    const std::uint32_t sides = cursor.context().sides | std::uint32_t(split.side()) << (2 * kCentre);
    counts.tets +=
        count_halves(state.domain, cursor.diamond(), cursor.parts(), sides) - count_tets(state.domain, cursor.diamond(), cursor.parts(), sides);
  }
  return {};
}

Wrong compare(const char* what, std::uint64_t counted, std::uint64_t kept) {
  if (counted == kept) return {};
  return "the number of " + std::string(what) + " is " + std::to_string(kept) + ", counted are " + std::to_string(counted);
}

}  // namespace

std::optional<std::string> Front::validate() const {
  FrontCursor cursor(state_);
  const Diamond root(state_.domain.root());
  cursor.move_to(root);
  if (!cursor.gather_sides(kSlotOfType[root.type])) return "the root is not there";
  Counts counts{0, 0, count_tets(state_.domain, root, cursor.parts(), cursor.context().sides), 0};
  for (const Block& block : state_.blocks) {
    if (auto wrong = validate_block(state_, block, cursor, counts)) return wrong;
  }
  if (auto wrong = compare("split diamonds", counts.splits, state_.split_count)) return wrong;
  if (auto wrong = compare("shown splits", counts.shown, state_.shown_count)) return wrong;
  if (auto wrong = compare("hidden splits that count", counts.withheld, state_.values.withheld)) return wrong;
  return compare("tetrahedra", counts.tets, state_.tet_count);
}

}  // namespace intervale
