#include "common/front/front_state.h"

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
  std::size_t bytes = origin.memory_bytes() + index.memory_bytes() + q.capacity();
  for (const Block& block : blocks) bytes += block.memory_bytes();
  return bytes;
}

void FrontState::pack() {
  std::deque<Block> kept;
  std::vector<std::uint8_t> kept_q;
  PointId kept_points = 0;
  const auto pack_points = [&](Block& block, bool has_q) {
    block.placed.reshape(block.placed.slots() & (values ? block.shown : block.split));
    for (const Slot slot : set_bits<Slot>(block.placed.slots())) {
      Split s = block.placed[slot];
      if (has_q) {
        const std::span<const std::uint8_t> cuts = cuts_of(s);
        kept_q.insert(kept_q.end(), cuts.begin(), cuts.end());
        if (s.side() == Side::inside) kept_q.push_back(0);
      }
      s.first = kept_points;
      kept_points += s.points();
      block.placed.set(slot, s);
    }
  };
  index.clear();
  pack_points(origin, true);
  for (Block& block : blocks) {
    if (block.split == 0) continue;
    pack_points(block, !values || is_root_block(block));
    index.obtain(block.scale, block.position) = std::uint32_t(kept.size());
    kept.push_back(std::move(block));
  }
  blocks = std::move(kept);
  kept_q.shrink_to_fit();
  q = std::move(kept_q);
  points = kept_points;
  ++point_generation;
}

}  // namespace intervale
