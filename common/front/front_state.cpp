#include "common/front/front_state.h"

#include <utility>

#include "common/util/bits.h"

namespace intervale {

std::uint32_t FrontState::obtain_number(int scale, Vertex position) {
  std::uint32_t& number = index.obtain(scale, position);
  if (number == kNone) {
    number = std::uint32_t(blocks.size());
    blocks.emplace_back();
    blocks.back().position = position;
    blocks.back().scale = scale;
  }
  return number;
}

std::size_t FrontState::memory_bytes() const {
  std::size_t bytes = origin.memory_bytes() + index.memory_bytes();
  for (const Block& block : blocks) bytes += block.memory_bytes();
  return bytes;
}

void FrontState::pack() {
  std::deque<Block> kept;
  std::size_t kept_points = 0;
  const auto pack_points = [&](Block& block) {
    block.placed.keep(block.placed.slots() & block.shown);
    for (const Slot slot : set_bits<Slot>(block.placed.slots())) {
      Split s = block.placed[slot];
      s.first = PointId(kept_points);
      kept_points += s.points();
      block.placed.set(slot, s);
    }
  };
  index.clear();
  pack_points(origin);
  for (Block& block : blocks) {
    if (block.split == 0) continue;
    pack_points(block);
    index.obtain(block.scale, block.position) = std::uint32_t(kept.size());
    kept.push_back(std::move(block));
  }
  blocks = std::move(kept);
  points = kept_points;
  ++point_generation;
}

}  // namespace intervale
