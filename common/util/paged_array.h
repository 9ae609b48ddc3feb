// An array that takes memory only for pages of elements that were used.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

namespace intervale {

// An element is T() at first, and where its page is not used. Memory: eight bytes for each page, and the pages that are used.
template <class T, std::size_t Page = 64>
class PagedArray {
 public:
  explicit PagedArray(std::size_t size = 0) : size_(size), pages_((size + Page - 1) / Page) {}

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const T& operator[](std::size_t i) const {
    const auto& page = pages_[i / Page];
    return page ? (*page)[i % Page] : kFirst;
  }
  // Of a page that is used from now on.
  [[nodiscard]] T& use(std::size_t i) {
    auto& page = pages_[i / Page];
    if (!page) {
      page = std::make_unique<std::array<T, Page>>();
      ++used_;
    }
    return (*page)[i % Page];
  }

  // Pages, by number.
  [[nodiscard]] std::size_t pages() const { return pages_.size(); }
  [[nodiscard]] static constexpr std::size_t page_of(std::size_t i) { return i / Page; }
  [[nodiscard]] static constexpr std::size_t begin_of(std::size_t page) { return page * Page; }
  [[nodiscard]] std::size_t end_of(std::size_t page) const { return std::min(size_, (page + 1) * Page); }
  [[nodiscard]] bool is_used(std::size_t page) const { return pages_[page] != nullptr; }
  void release(std::size_t page) {
    used_ -= std::size_t(is_used(page));
    pages_[page].reset();
  }
  void release_all() {
    if (used_ == 0) return;
    for (auto& page : pages_) page.reset();
    used_ = 0;
  }

  // With the allocator's.
  [[nodiscard]] std::size_t memory_bytes() const { return pages_.capacity() * sizeof pages_[0] + used_ * (sizeof(std::array<T, Page>) + kAllocator); }

 private:
  static constexpr T kFirst{};
  static constexpr std::size_t kAllocator = 16;
  std::size_t size_ = 0, used_ = 0;
  std::vector<std::unique_ptr<std::array<T, Page>>> pages_;
};

}  // namespace intervale
