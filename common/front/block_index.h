// The numbers of a front's blocks, by scale and position of their supercubes.
//
// Supercubes are grouped in bricks, the 4 x 4 x 4 of one scale whose positions differ in the lowest two bits only. A
// brick is found in a hash table, which is small enough to stay in a cache, and has its blocks' numbers side by side:
// so looking up the supercubes around one takes few accesses to memory, and needs no cache of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/diamond/diamond.h"

namespace intervale {

// Many threads may look up while none adds.
class BlockIndex {
 public:
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  // The number of a supercube's block, or kNone. Positions have no more than 19 bits.
  [[nodiscard]] std::uint32_t find(int scale, Vertex position) const {
    const std::uint32_t brick = bricks_[find_brick(brick_key(scale, position))].brick;
    return brick == kNone ? kNone : numbers_[brick][place_of(position)];
  }
  // The same, to be set; kNone if the supercube is new. Valid until the next call.
  [[nodiscard]] std::uint32_t& obtain(int scale, Vertex position);
  void clear() { *this = {}; }
  [[nodiscard]] std::size_t memory_bytes() const { return bricks_.capacity() * sizeof(Entry) + numbers_.capacity() * sizeof(Numbers); }

 private:
  struct Entry {
    std::uint64_t key = 0;
    std::uint32_t brick = kNone;  // its place in numbers_; kNone if the entry is free
  };
  using Numbers = std::array<std::uint32_t, 64>;  // of a brick's supercubes, kNone where there is none

  static std::uint64_t brick_key(int scale, Vertex p) {
    return std::uint64_t(scale) << 57 | std::uint64_t(std::uint32_t(p.z) >> 2) << 38 | std::uint64_t(std::uint32_t(p.y) >> 2) << 19 |
           std::uint32_t(p.x) >> 2;
  }
  static std::size_t place_of(Vertex p) { return unsigned(p.x & 3) | unsigned(p.y & 3) << 2 | unsigned(p.z & 3) << 4; }
  // The entry of a brick, or the free one where it belongs.
  [[nodiscard]] std::size_t find_brick(std::uint64_t key) const {
    std::size_t i = std::size_t(key * 0x9e3779b97f4a7c15u >> shift_);
    while (bricks_[i].key != key && bricks_[i].brick != kNone) i = (i + 1) & (bricks_.size() - 1);
    return i;
  }
  void grow();

  int shift_ = 60;
  std::vector<Entry> bricks_ = std::vector<Entry>(16);  // a hash table, at most half full; 2^(64 - shift_) entries
  std::vector<Numbers> numbers_;
};

}  // namespace intervale
