// The split diamonds as a set of updates.
#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "common/diamond/supercube.h"

namespace intervale {

// A set of updates, by number: a bit for each in pages of 4096, of which those are stored that had an update once.
class SplitSet {
 public:
  explicit SplitSet(std::uint32_t size = 0) : page_(std::size_t(size) / kPage + 2), words_(kPageWords) {}
  [[nodiscard]] bool contains(UpdateIndex i) const { return word(i / 64) >> (i % 64) & 1; }
  // Which of `count` updates from `first` on are in it, a bit each; count in [1, 64].
  [[nodiscard]] std::uint64_t some(UpdateIndex first, unsigned count) const {
    // Without a branch: two words are read as fast as one.
    const unsigned shift = first % 64;
    const std::uint64_t bits = word(first / 64) >> shift | word(first / 64 + 1) << 1 << (63 - shift);
    return bits & (~std::uint64_t(0) >> (64 - count));
  }
  // Whether none of `count` updates from `first` on was ever in it, as far as pages tell; count at least 1.
  [[nodiscard]] bool is_untouched(UpdateIndex first, unsigned count) const {
    for (std::uint32_t page = first / kPage; page <= (first + count - 1) / kPage; ++page) {
      if (page_[page] != 0) return false;
    }
    return true;
  }
  void insert(UpdateIndex i) { insert_bits(i / 64, std::uint64_t(1) << (i % 64)); }
  void insert_all();  // of all numbers that it can hold, a few more than its size
  void erase(UpdateIndex i) { erase_bits(i / 64, std::uint64_t(1) << (i % 64)); }
  [[nodiscard]] std::uint64_t count() const;
  [[nodiscard]] std::size_t memory_bytes() const { return page_.capacity() * sizeof page_[0] + words_.capacity() * sizeof words_[0]; }
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
  [[nodiscard]] std::vector<SlotGroup> groups(const SupercubeSet& set) const;  // all of it, in order
  friend bool operator==(const SplitSet& a, const SplitSet& b);

 private:
  static constexpr std::uint32_t kPage = 4096, kPageWords = kPage / 64;
  [[nodiscard]] std::uint64_t word(std::uint32_t w) const { return words_[std::size_t(page_[w / kPageWords]) * kPageWords + w % kPageWords]; }
  void insert_bits(std::uint32_t w, std::uint64_t bits);
  void erase_bits(std::uint32_t w, std::uint64_t bits);
  std::vector<std::uint32_t> page_;   // of each 4096 numbers, and one more; 0: none is in it
  std::vector<std::uint64_t> words_;  // by page, the first one empty
};

}  // namespace intervale
