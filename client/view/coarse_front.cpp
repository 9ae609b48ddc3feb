#include "client/view/coarse_front.h"

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/util/bits.h"

namespace intervale {
namespace {

// The slots of the levels that stay. Finest first: class 2, 1 and 0 of scale 0, then those of scale 1.
std::uint64_t slots_that_stay(int scale, int levels) {
  std::uint64_t slots = 0;
  for (int cls = 0; cls < 3; ++cls) slots |= 3 * scale + 2 - cls >= levels ? kSlotsOfClass[std::size_t(cls)] : 0;
  return slots;
}

// Of splits that have their parents with them, coarse scales first.
Front without_finest(std::vector<SlotGroup> groups, const Description& description, const Front& fine, int levels) {
  for (SlotGroup& group : groups) group.slots &= slots_that_stay(scale_of_key(group.key), levels);
  std::erase_if(groups, [](const SlotGroup& group) { return group.slots == 0; });
  Front coarse(description.grid, description.format, description.corners, fine.range(), fine.refine());
  const auto keys_of = [&fine](const SlotGroup& group, std::span<ValueKey, kSlots> keys) {
    const FrontState::Block* const block = fine.state().find_block(scale_of_key(group.key), position_of_key(group.key));
    for (const Slot slot : set_bits<Slot>(group.slots)) keys[slot] = block->key[slot];
  };
  [[maybe_unused]] const auto misfit = coarse.split_all(groups, keys_of);
  assert(!misfit && "parents are of coarser levels");
  return coarse;
}

}  // namespace

Front coarse_front(const StreamClient& client, int levels) {
  return without_finest(client.front().splits(), client.description(), client.front(), levels);
}

Front coarse_shown_front(const StreamClient& client, const Front& fine, int levels) {
  std::vector<SlotGroup> groups = fine.splits();
  for (SlotGroup& group : groups) group.slots &= fine.shown_slots(group.key);
  return without_finest(std::move(groups), client.description(), fine, levels);
}

std::vector<std::uint64_t> counts_without_finest(const StreamClient& client) {
  std::vector<std::uint64_t> counts{0};  // first: of each level by itself
  for (const SlotGroup& group : client.front().splits()) {
    const auto level = std::size_t(3 * scale_of_key(group.key));
    if (counts.size() < level + 4) counts.resize(level + 4);
    for (std::size_t cls = 0; cls < 3; ++cls) counts[level + 2 - cls] += std::uint64_t(std::popcount(group.slots & kSlotsOfClass[cls]));
  }
  for (std::size_t level = counts.size() - 1; level > 0; --level) counts[level - 1] += counts[level];
  return counts;
}

}  // namespace intervale
