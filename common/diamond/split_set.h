// The split diamonds as a set of updates.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/util/sparse_array.h"

namespace intervale {

// A set of updates, by number: 32 bits for each 32 updates of which one was in it once, and a little more (SparseArray).
class SplitSet {
 public:
  explicit SplitSet(std::size_t size = 0) : chunks_(size / 32 + 4) {}
  [[nodiscard]] bool contains(UpdateIndex i) const { return chunks_.get(i / 32) >> (i % 32) & 1; }
  // Which of `count` updates from `first` on are in it, a bit each; count in [1, 64].
  [[nodiscard]] std::uint64_t some(UpdateIndex first, unsigned count) const {
    return chunks_.bits(first / 32, unsigned(first % 32)) & (~std::uint64_t(0) >> (64 - count));
  }
  // Whether none of `count` updates from `first` on was ever in it, as far as chunks tell; count at least 1.
  [[nodiscard]] bool is_untouched(UpdateIndex first, unsigned count) const { return !chunks_.uses_any(first / 32, (first + count - 1) / 32 + 1); }
  // How many of `count` updates from `first` on are in it; count at least 1.
  [[nodiscard]] unsigned count(UpdateIndex first, unsigned count) const;
  void insert(UpdateIndex i) { insert_bits(i / 64, std::uint64_t(1) << (i % 64)); }
  void erase(UpdateIndex i) { erase_bits(i / 64, std::uint64_t(1) << (i % 64)); }
  [[nodiscard]] std::uint64_t count() const;
  [[nodiscard]] std::size_t memory_bytes() const { return chunks_.memory_bytes(); }
  // The slots of a supercube's diamonds that are in it; inserts and erases some. occupancy: of that supercube, not 0,
  // and the slots are among it; first: the number of its first diamond.
  [[nodiscard]] std::uint64_t slots(UpdateIndex first, std::uint64_t occupancy) const {
    const auto count = unsigned(std::popcount(occupancy));
    const std::uint64_t bits = some(first, count);
    return bits == ~std::uint64_t(0) >> (64 - count) ? occupancy : bits == 0 ? 0 : deposit(bits, occupancy);
  }
  void insert(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots);
  void erase(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots);
  // Moves the lowest bits of `bits`, in their order, to the positions of the ones of `mask`.
  [[nodiscard]] static std::uint64_t deposit(std::uint64_t bits, std::uint64_t mask);
  // The inverse: moves the bits at the ones of `mask` to the lowest positions, in their order.
  [[nodiscard]] static std::uint64_t extract(std::uint64_t bits, std::uint64_t mask);
  [[nodiscard]] std::vector<SlotGroup> groups(const SupercubeSet& set) const;  // all of it, in order
  friend bool operator==(const SplitSet& a, const SplitSet& b);

 private:
  void insert_bits(std::size_t w, std::uint64_t bits);
  void erase_bits(std::size_t w, std::uint64_t bits);
  SparseArray<std::uint32_t> chunks_;  // of 32 updates each
};

}  // namespace intervale
