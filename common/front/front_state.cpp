#include "common/front/front_state.h"

#include "common/util/bits.h"

namespace intervale {
namespace {

// A supercube's key in the index. Positions have no more than 19 bits.
std::uint64_t index_key(int scale, Vertex p) {
  return std::uint64_t(scale) << 57 | std::uint64_t(std::uint32_t(p.z)) << 38 | std::uint64_t(std::uint32_t(p.y)) << 19 | std::uint32_t(p.x);
}

}  // namespace

std::uint32_t FrontState::find_number(int scale, Vertex position) const {
  const auto found = index.find(index_key(scale, position));
  return found == index.end() ? kNone : found->second;
}

FrontState::Block& FrontState::obtain_block(int scale, Vertex position) {
  const auto [place, is_new] = index.try_emplace(index_key(scale, position), std::uint32_t(blocks.size()));
  if (is_new) {
    blocks.emplace_back();
    blocks.back().position = position;
    blocks.back().scale = scale;
  }
  return blocks[place->second];
}

std::size_t FrontState::memory_bytes() const {
  std::size_t bytes = blocks.size() * sizeof(Block) + index.bucket_count() * 17 + q.capacity();
  for (const Block& block : blocks) bytes += block.of.memory_bytes() + block.key.memory_bytes();
  return bytes;
}

void FrontState::pack() {
  std::deque<Block> kept;
  std::vector<std::uint8_t> kept_q;
  const auto pack_cuts = [&](Block& block) {
    block.neighbours = {};
    const std::uint64_t with_cuts = values ? block.shown : block.split;
    block.placed = with_cuts;
    block.of.reshape(with_cuts);
    for (const Slot slot : set_bits<Slot>(with_cuts)) {
      Split s = block.of[slot];
      const std::span<const std::uint8_t> cuts = cuts_of(s);
      s.first = PointId(kept_q.size());
      kept_q.insert(kept_q.end(), cuts.begin(), cuts.end());
      if (s.side() == Side::inside) kept_q.push_back(0);
      block.of.set(slot, s);
    }
  };
  index.clear();
  pack_cuts(origin);
  for (Block& block : blocks) {
    if (block.split == 0) continue;
    pack_cuts(block);
    index.emplace(index_key(block.scale, block.position), std::uint32_t(kept.size()));
    kept.push_back(std::move(block));
  }
  blocks = std::move(kept);
  kept_q.shrink_to_fit();
  q = std::move(kept_q);
  ++point_generation;
}

}  // namespace intervale
