// An array that takes memory only for the elements that were set.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

namespace intervale {

// Elements are used, once they were set, or not. Memory: eight bytes for each page of 1024 elements; for each page
// with a used one some 190 bytes besides, and its used elements. Use of another element moves up to a page.
template <std::unsigned_integral T>
class SparseArray {
 public:
  explicit SparseArray(std::size_t size = 0) : pages_((size + kPage - 1) / kPage) {}
  // nullopt: not used.
  [[nodiscard]] std::optional<T> find(std::size_t i) const {
    const Block& block = pages_[i / kPage];
    if (!block || !is_used(block, i)) return {};
    return load<T>(block.get() + offset(block, i));
  }
  // Which of 64 elements from i on, a multiple of 64, are used; a bit each.
  [[nodiscard]] std::uint64_t used(std::size_t i) const {
    const Block& block = pages_[i / kPage];
    return block ? load<std::uint64_t>(block.get() + i % kPage / 64 * 8) : 0;
  }
  // Uses an element from now on.
  void set(std::size_t i, T value) { store(use(i) + offset(pages_[i / kPage], i), value); }
  [[nodiscard]] std::size_t memory_bytes() const { return pages_.capacity() * sizeof pages_[0] + block_bytes_; }  // with the allocator's

 private:
  // Of a page with used elements: a bit for each of 1024 elements, whether it is used; for each of these sixteen words, how
  // many elements are used before, in two bytes; the used elements. nullptr: there are none.
  using Block = std::unique_ptr<std::byte[]>;
  static constexpr std::size_t kPage = 1024, kWords = kPage / 64, kHead = kWords * 10;
  static constexpr std::size_t kAllocator = 8;  // what an allocator takes for a block; their sum is a multiple of 16
  template <class U>
  [[nodiscard]] static U load(const std::byte* from) {
    U value;
    std::memcpy(&value, from, sizeof value);
    return value;
  }
  template <class U>
  static void store(std::byte* to, U value) {
    std::memcpy(to, &value, sizeof value);
  }
  // Used elements before a word's.
  [[nodiscard]] static std::size_t used_before(const std::byte* block, std::size_t word) {
    return load<std::uint16_t>(block + kWords * 8 + word * 2);
  }
  [[nodiscard]] static bool is_used(const Block& block, std::size_t i) {
    return (load<std::uint64_t>(block.get() + i % kPage / 64 * 8) >> (i % 64) & 1) != 0;
  }
  // Where the element is in its block, if it is used; and otherwise would be.
  [[nodiscard]] static std::size_t offset(const Block& block, std::size_t i) {
    const std::size_t word = i % kPage / 64;
    const auto used = load<std::uint64_t>(block.get() + word * 8) & ((std::uint64_t(1) << (i % 64)) - 1);
    return kHead + (used_before(block.get(), word) + std::size_t(std::popcount(used))) * sizeof(T);
  }
  [[nodiscard]] static std::size_t count(const Block& block) {
    return used_before(block.get(), kWords - 1) + std::size_t(std::popcount(load<std::uint64_t>(block.get() + (kWords - 1) * 8)));
  }
  // Of a block with so many elements.
  [[nodiscard]] static std::size_t capacity(std::size_t elements) { return (kHead + elements * sizeof(T) + kAllocator + 15) / 16 * 16 - kAllocator; }
  [[nodiscard]] static Block copy_of(const Block& block, std::size_t bytes, std::size_t elements) {
    Block copy(new std::byte[bytes]);  // the browser's library lacks std::make_unique_for_overwrite
    if (block)
      std::copy_n(block.get(), kHead + elements * sizeof(T), copy.get());
    else
      std::fill_n(copy.get(), kHead, std::byte(0));
    return copy;
  }
  std::byte* use(std::size_t i) {
    Block& block = pages_[i / kPage];
    if (block && is_used(block, i)) return block.get();
    const std::size_t elements = block ? count(block) : 0;
    const std::size_t before = block ? capacity(elements) + kAllocator : 0, after = capacity(elements + 1) + kAllocator;
    if (before != after) {
      block = copy_of(block, after - kAllocator, elements);
      block_bytes_ += after - before;
    }
    const std::size_t word = i % kPage / 64, at = offset(block, i), end = kHead + elements * sizeof(T);
    std::memmove(block.get() + at + sizeof(T), block.get() + at, end - at);
    store(block.get() + at, T(0));
    store(block.get() + word * 8, load<std::uint64_t>(block.get() + word * 8) | std::uint64_t(1) << (i % 64));
    for (std::size_t w = word + 1; w < kWords; ++w) store(block.get() + kWords * 8 + w * 2, std::uint16_t(used_before(block.get(), w) + 1));
    return block.get();
  }

  std::vector<Block> pages_;
  std::size_t block_bytes_ = 0;
};

}  // namespace intervale
