#include <string>

#include "common/front/front.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

struct Counts {
  std::uint64_t splits = 0, shown = 0, tets = 0;
};

// The first violation in one supercube, and what it adds to the counts.
std::optional<std::string> validate_block(const FrontState& state, const Block& block, FrontCursor& cursor, Counts& counts) {
  if (state.find_block(block.scale, block.position) != &block) return "a supercube is not found under its scale and position";
  if ((block.shown & ~block.split) != 0) return "a diamond is shown as split, but is not split";
  if (state.is_root_block(block)) return {};
  cursor.move_to(block.scale, block.position);
  for (const Slot slot : set_bits<Slot>(block.split)) {
    const Vertex c = centre_of(block.scale, block.position, slot);
    const auto where = " at (" + std::to_string(c.x) + ", " + std::to_string(c.y) + ", " + std::to_string(c.z) + ")";
    const Split& split = block.of[slot];
    if (!cursor.gather(slot)) return "a diamond is split before its parents" + where;
    if (unsigned(split.side()) > 2) return "a side is not below, inside or above" + where;
    if (split.cut_bits() != cursor.context().cut_bits(split.side())) return "the cuts do not fit the sides" + where;
    if (std::size_t(split.first) + split.points() > state.q.size()) return "a cut is out of range" + where;
    ++counts.splits;
    if (!block.is_shown(slot)) continue;
    ++counts.shown;
    if (!cursor.parents_are_shown()) return "a split is shown, but a parent's is hidden" + where;
    const std::uint32_t sides = cursor.context().sides | std::uint32_t(split.side()) << (2 * kCentre);
    counts.tets +=
        count_halves(state.domain, cursor.diamond(), cursor.parts(), sides) - count_tets(state.domain, cursor.diamond(), cursor.parts(), sides);
  }
  return {};
}

std::optional<std::string> compare(const char* what, std::uint64_t counted, std::uint64_t kept) {
  if (counted == kept) return {};
  return "the number of " + std::string(what) + " is " + std::to_string(kept) + ", counted are " + std::to_string(counted);
}

}  // namespace

std::optional<std::string> Front::validate() const {
  FrontCursor cursor(state_);
  const Diamond root(state_.domain.root());
  cursor.move_to(root);
  if (!cursor.gather(kSlotOfType[root.type])) return "the root is not there";
  Counts counts{0, 0, count_tets(state_.domain, root, cursor.parts(), cursor.context().sides)};
  for (const Block& block : state_.blocks) {
    if (auto wrong = validate_block(state_, block, cursor, counts)) return wrong;
  }
  if (auto wrong = compare("split diamonds", counts.splits, state_.split_count)) return wrong;
  if (auto wrong = compare("shown splits", counts.shown, state_.shown_count)) return wrong;
  return compare("tetrahedra", counts.tets, state_.tet_count);
}

}  // namespace intervale
