// Whether untrusted text is UTF-8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace intervale {

// Well-formed UTF-8 (The Unicode Standard, table 3-7): no overlong forms, no surrogates, nothing above U+10FFFF.
[[nodiscard]] inline bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto first = std::uint8_t(text[i++]);
    if (first < 0x80) continue;
    if (first < 0xc2 || first > 0xf4) return false;
    const int more = first < 0xe0 ? 1 : first < 0xf0 ? 2 : 3;
    // The bounds of the second byte; those after it are 80 to bf.
    std::uint8_t low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80, high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    for (int k = 0; k < more; ++k) {
      if (i == text.size() || std::uint8_t(text[i]) < low || std::uint8_t(text[i]) > high) return false;
      low = 0x80;
      high = 0xbf;
      ++i;
    }
  }
  return true;
}

}  // namespace intervale
