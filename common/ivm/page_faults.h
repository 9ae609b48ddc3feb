// What is lost of a file with damaged pages (value_page.h), for those who go on without them.
//
// A page is lost if its bytes are damaged, or if it may need values of a coarser page that is lost. An update is lost if
// its value is, or that of an ancestor. All others are as in the undamaged file, and refine its mesh without a crack.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/value_page.h"

namespace intervale {

struct DamagedPage {
  std::size_t number = 0, of = 0;  // from 0, and how many there are
  int scale = 0;                   // the finest of its diamonds
  // Where its diamonds' centres lie: samples, closed.
  std::array<std::int32_t, 3> first{}, last{};
  std::string channel;  // whose page it is; empty: the field's
};
// "page 3 of 12 (scale 0, samples (0, 0, 64) to (127, 127, 127))", and of what channel.
[[nodiscard]] std::string to_text(const DamagedPage& page);

struct PageFaults {
  std::vector<DamagedPage> damaged;
  std::vector<bool> lost;          // by page, of the field or of any channel; empty: none
  std::uint64_t lost_updates = 0;  // once the file is read
  [[nodiscard]] bool any() const { return !damaged.empty(); }
};

// "2 pages are damaged: page 3 of 12 (...), page 7 of 12 (...)": the first four, and how many more.
[[nodiscard]] std::string to_text(const PageFaults& faults);

// Which pages need what is lost, found from coarse to fine. One thread.
class LostPages {
 public:
  // Both must outlive it.
  LostPages(const SupercubeSet& set, std::span<const ValuePage> pages) : set_(set), pages_(pages), is_lost_(pages.size()) {}

  // Page after page: whether a coarser one that it may need is lost. Then it is lost, too.
  [[nodiscard]] bool needs_lost(std::size_t page) const;
  // Before any finer page is asked for.
  void lose(std::span<const std::size_t> pages);
  [[nodiscard]] const std::vector<bool>& lost() const { return is_lost_; }

 private:
  const SupercubeSet& set_;
  std::span<const ValuePage> pages_;
  std::vector<bool> is_lost_;
  std::vector<BlockKey> blocks_;  // lost; ascending
};

// Where a page lies, of values on a grid with these dims.
[[nodiscard]] DamagedPage place_of(const SupercubeSet& set, std::span<const ValuePage> pages, std::size_t page,
                                   const std::array<std::int32_t, 3>& dims);

// By supercube: the slots whose updates are not lost. Closed under parents. O(updates).
[[nodiscard]] std::vector<std::uint64_t> slots_left(const Domain& domain, const SupercubeSet& set, const std::vector<bool>& lost);

}  // namespace intervale
