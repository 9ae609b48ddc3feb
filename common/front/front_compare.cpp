#include <algorithm>
#include <vector>

#include "common/front/front.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

using Block = FrontState::Block;

// Whether `whole` has equal splits for all of a block of another front.
bool has_splits_of(const FrontState& whole, const Block& block) {
  if (block.split == 0) return true;  // all of it was merged
  const Block* const same = whole.find_block(block.scale, block.position);
  if (same == nullptr || (block.split & ~same->split) != 0) return false;
  for (const Slot slot : set_bits<Slot>(block.split)) {
    if (block.key[slot] != same->key[slot]) return false;
  }
  return true;
}

}  // namespace

bool Front::is_part_of(const Front& other) const {
  if (state_.grid != other.state_.grid || format() != other.format() || range() != other.range()) return false;
  // The domain's corners are compared as splits are: they are a block, but for the one at the origin.
  if (state_.origin.key[0] != other.state_.origin.key[0]) return false;
  // No std::ranges algorithms in this folder: Debian 12's Emscripten, which compiles it for the viewer, has none.
  return std::all_of(state_.blocks.begin(), state_.blocks.end(), [&](const Block& block) { return has_splits_of(other.state_, block); });
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
