#include <string>

#include "common/front/front.h"

namespace intervale {

std::optional<std::string> Front::validate() const {
  std::uint64_t splits = 0, shown = 0;
  Cursor cursor(*this);
  const Diamond root(domain_.root());
  cursor.move_to(root.scale, {});
  if (!cursor.gather(kSlotOfType[root.type])) return "the root is not there";
  const DiamondContext& context = cursor.context();
  std::uint64_t tets = count_tets(root, existing(root), context.sides);
  for (const Block& block : blocks_) {
    if (find_block(block.scale, block.position) != &block) return "a supercube is filed under another's name";
    if (block.scale == domain_.levels()) continue;
    cursor.move_to(block.scale, block.position);
    for (std::uint64_t left = block.split; left != 0; left &= left - 1) {
      const int slot = std::countr_zero(left);
      const Diamond d(centre_of(supercube_key(block.scale, block.position), slot));
      const auto where = " at (" + std::to_string(d.centre.x) + ", " + std::to_string(d.centre.y) + ", " + std::to_string(d.centre.z) + ")";
      const Split& split = block.of[slot];
      if (!cursor.gather(slot)) return "a diamond is split before its parents" + where;
      if (unsigned(split.side()) > 2) return "a side is none" + where;
      if ((split.bits & kCutBits) != context.cut_bits(split.side())) return "the cuts do not fit the sides" + where;
      if (std::size_t(split.centre()) + (split.side() == Side::inside ? 1 : 0) > q_.size()) return "a cut has no place" + where;
      ++splits;
      if (!(block.shown >> slot & 1)) continue;
      ++shown;
      if (!cursor.parents_are_shown()) return "a split is shown before its parents'" + where;
      const Existing e = existing(d);
      const std::uint32_t sides = context.sides | std::uint32_t(split.side()) << (2 * kCentre);
      tets += count_halves(d, e, sides) - count_tets(d, e, sides);
    }
    if ((block.shown & ~block.split) != 0) return "what is not split is shown";
  }
  if (splits != split_count_) return "the split diamonds are miscounted: " + std::to_string(split_count_) + " for " + std::to_string(splits);
  if (shown != shown_count_) return "the shown splits are miscounted: " + std::to_string(shown_count_) + " for " + std::to_string(shown);
  if (tets != tet_count_) return "the tetrahedra are miscounted: " + std::to_string(tet_count_) + " for " + std::to_string(tets);
  return {};
}

}  // namespace intervale
