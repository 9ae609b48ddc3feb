// Damage to chosen pages of an .ivm file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace intervale::testing {

// Where a stream of a file lies: offset and bytes, from the table of streams.
struct StreamPlace {
  std::uint64_t offset = 0, bytes = 0;
};
inline StreamPlace place_of_stream(const std::vector<std::byte>& file, std::uint32_t type) {
  std::uint32_t streams = 0;
  std::memcpy(&streams, file.data() + 12, sizeof streams);
  for (std::uint32_t i = 0; i < streams; ++i) {
    std::uint32_t found = 0;
    StreamPlace place;
    const std::byte* const entry = file.data() + 40 + 32 * std::size_t(i);
    std::memcpy(&found, entry, sizeof found);
    std::memcpy(&place, entry + 8, sizeof place);
    if (found == type) return place;
  }
  return {};
}

// How many pages the field has.
inline std::size_t page_count(const std::vector<std::byte>& file) { return place_of_stream(file, 3).bytes / 16; }

// Flips a bit in the middle of a page of the field.
inline void damage_page(std::vector<std::byte>& file, std::size_t page) {
  const StreamPlace index = place_of_stream(file, 3);
  std::uint64_t at = place_of_stream(file, 4).offset, bytes = 0;
  for (std::size_t i = 0; i <= page; ++i) {
    at += bytes;
    std::memcpy(&bytes, file.data() + index.offset + 16 * i, sizeof bytes);
  }
  file[at + bytes / 2] ^= std::byte(4);
}

}  // namespace intervale::testing
