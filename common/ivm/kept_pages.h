// Compressed pages (value_page.h) that outlive the program that compresses them, so that another one goes on from there.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace intervale {

// Which page of a file: of the field's values (0), or of those of a component of a channel (from 1 on, channel by channel);
// and its number among the pages of the set.
struct PageName {
  std::uint32_t values = 0, page = 0;
};

// Both functions are called from any thread, several at a time.
class KeptPages {
 public:
  KeptPages() = default;
  KeptPages(const KeptPages&) = delete;
  KeptPages& operator=(const KeptPages&) = delete;
  virtual ~KeptPages() = default;

  // The bytes of a page that was kept, just as they were. Nothing: it is to be compressed.
  [[nodiscard]] virtual std::optional<std::vector<std::uint8_t>> find(const PageName& name) = 0;
  // What it throws ends the compression.
  virtual void keep(const PageName& name, std::span<const std::uint8_t> bytes) = 0;
};

}  // namespace intervale
