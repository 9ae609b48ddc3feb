#include <algorithm>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front/front.h"

namespace intervale {
namespace {

// No std::ranges algorithms in this file: Debian 12's Emscripten, which compiles it for the viewer, has none.
bool equal(std::span<const std::uint8_t> a, std::span<const std::uint8_t> b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

}  // namespace

// Whether what is split in a block of `owner` is split here too, alike.
bool Front::has_splits_of(const Block& block, const Front& owner) const {
  if (block.split == 0) return true;  // all of it was merged
  const Block* const mine = find_block(block.scale, block.position);
  if (mine == nullptr || (block.split & ~mine->split) != 0) return false;
  for (std::uint64_t left = block.split; left != 0; left &= left - 1) {
    const int slot = std::countr_zero(left);
    const Split& its = block.of[slot];
    const Split& ours = mine->of[slot];
    if (its.bits != ours.bits || !equal(owner.cuts_of(its), cuts_of(ours))) return false;
  }
  return true;
}

bool Front::is_part_of(const Front& other) const {
  if (grid_ != other.grid_) return false;
  // The base is compared as splits are: its corners are blocks, but for the one at the origin.
  const Split& corner = corner_.of[0];
  const Split& its_corner = other.corner_.of[0];
  if (corner.bits != its_corner.bits || !equal(cuts_of(corner), other.cuts_of(its_corner))) return false;
  return std::all_of(blocks_.begin(), blocks_.end(), [&](const Block& block) { return other.has_splits_of(block, *this); });
}

bool Front::coarsen_to(const Front& coarse) {
  std::vector<const Block*> fine_first;
  for (const Block& block : blocks_) {
    if (block.scale < domain_.levels()) fine_first.push_back(&block);  // the base is never merged
  }
  std::stable_sort(fine_first.begin(), fine_first.end(), [](const Block* a, const Block* b) { return a->scale < b->scale; });
  for (auto first = fine_first.begin(), last = first; first != fine_first.end(); first = last) {
    while (last != fine_first.end() && (*last)->scale == (*first)->scale) ++last;
    for (int cls = 2; cls >= 0; --cls) {
      for (auto block = first; block != last; ++block) {
        const Block* const kept = coarse.find_block((*block)->scale, (*block)->position);
        const std::uint64_t surplus = (*block)->split & kSlotsOfClass[cls] & ~(kept == nullptr ? 0 : kept->shown);
        for (std::uint64_t left = surplus; left != 0; left &= left - 1) {
          if (!merge(centre_of((*block)->scale, (*block)->position, std::countr_zero(left)))) return false;
        }
      }
    }
  }
  return true;
}

}  // namespace intervale
