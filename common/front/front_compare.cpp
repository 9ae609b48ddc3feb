#include <algorithm>
#include <vector>

#include "common/front/front.h"
#include "common/util/bits.h"

namespace intervale {

namespace {

using Block = FrontState::Block;
using Split = FrontState::Split;

// No std::ranges algorithms in this folder: Debian 12's Emscripten, which compiles it for the viewer, has none.
bool are_equal(const FrontState& a, const Split& split_a, const FrontState& b, const Split& split_b) {
  const auto cuts_a = a.cuts_of(split_a), cuts_b = b.cuts_of(split_b);
  return split_a.bits == split_b.bits && std::equal(cuts_a.begin(), cuts_a.end(), cuts_b.begin(), cuts_b.end());
}

// Whether `whole` has equal splits for all of a block of `part`.
bool has_splits_of(const FrontState& whole, const FrontState& part, const Block& block) {
  if (block.split == 0) return true;  // all of it was merged
  const Block* const same = whole.find_block(block.scale, block.position);
  if (same == nullptr || (block.split & ~same->split) != 0) return false;
  for (const Slot slot : set_bits<Slot>(block.split)) {
    if (part.values && block.key[slot] != same->key[slot]) return false;
    if (!part.values && !are_equal(part, block.split_at(slot), whole, same->split_at(slot))) return false;
  }
  return true;
}

}  // namespace

bool Front::is_part_of(const Front& other) const {
  const std::optional<FrontValues>&mine = state_.values, &others = other.state_.values;
  if (state_.grid != other.state_.grid || mine.has_value() != others.has_value()) return false;
  if (mine && (mine->format != others->format || mine->range != others->range)) return false;
  // The root patch is compared as splits are: the domain's corners are a block, but for the one at the origin.
  const bool same_origin = mine ? state_.origin.key[0] == other.state_.origin.key[0]
                                : are_equal(state_, state_.origin.split_at(Slot()), other.state_, other.state_.origin.split_at(Slot()));
  return same_origin &&
         std::all_of(state_.blocks.begin(), state_.blocks.end(), [&](const Block& block) { return has_splits_of(other.state_, state_, block); });
}

bool Front::coarsen_to(const Front& coarse) {
  std::vector<const Block*> fine_first;
  for (const Block& block : state_.blocks) {
    if (!state_.is_root_block(block)) fine_first.push_back(&block);
  }
  std::stable_sort(fine_first.begin(), fine_first.end(), [](const Block* a, const Block* b) { return a->scale < b->scale; });
  for (auto first = fine_first.begin(), last = first; first != fine_first.end(); first = last) {
    while (last != fine_first.end() && (*last)->scale == (*first)->scale) ++last;
    for (int cls = 2; cls >= 0; --cls) {
      for (auto block = first; block != last; ++block) {
        const Block* const kept = coarse.state_.find_block((*block)->scale, (*block)->position);
        const std::uint64_t surplus = (*block)->split & kSlotsOfClass[cls] & ~(kept == nullptr ? 0 : kept->shown);
        for (const Slot slot : set_bits<Slot>(surplus)) {
          if (!merge(centre_of((*block)->scale, (*block)->position, slot))) return false;
        }
      }
    }
  }
  return true;
}

}  // namespace intervale
