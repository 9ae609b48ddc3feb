// The numbers of a front's blocks, by scale and position of their supercubes.
//
// Supercubes are grouped in bricks, the 4 x 4 x 4 of one scale whose positions differ in the lowest two bits only. A
// brick is found in a hash table, which is small enough to stay in a cache, and has its blocks' numbers side by side:
// so looking up the supercubes around one takes few accesses to memory, and needs no cache of its own.
#pragma once

#include <array>
#include <boost/unordered/unordered_flat_map.hpp>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/diamond/diamond.h"

namespace intervale {

// Many threads may look up while none adds.
class BlockIndex {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  // The number of a supercube's block, or kNone. Positions have no more than 19 bits.
  [[nodiscard]] std::uint32_t find(int scale, Vertex position) const {
    const auto found = bricks_.find(brick_key(scale, position));
    return found == bricks_.end() ? kNone : numbers_[found->second][place_of(position)];
  }
  // The same, to be set; kNone if the supercube is new.
  [[nodiscard]] std::uint32_t& obtain(int scale, Vertex position) {
    const auto [found, is_new] = bricks_.try_emplace(brick_key(scale, position), std::uint32_t(numbers_.size()));
    if (is_new) numbers_.emplace_back().fill(kNone);
    return numbers_[found->second][place_of(position)];
  }
  void clear() {
    bricks_.clear();
    numbers_.clear();
  }
  [[nodiscard]] std::size_t memory_bytes() const { return bricks_.bucket_count() * 17 + numbers_.size() * (sizeof(numbers_[0]) + sizeof(void*)); }

 private:
  static std::uint64_t brick_key(int scale, Vertex p) {
    return std::uint64_t(scale) << 57 | std::uint64_t(std::uint32_t(p.z) >> 2) << 38 | std::uint64_t(std::uint32_t(p.y) >> 2) << 19 |
           std::uint32_t(p.x) >> 2;
  }
  static std::size_t place_of(Vertex p) { return unsigned(p.x & 3) | unsigned(p.y & 3) << 2 | unsigned(p.z & 3) << 4; }

  boost::unordered_flat_map<std::uint64_t, std::uint32_t> bricks_;  // places in numbers_
  std::deque<std::array<std::uint32_t, 64>> numbers_;               // of each brick's supercubes, kNone where there is none
};

}  // namespace intervale
