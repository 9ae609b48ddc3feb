// Makes untrusted text, such as the name of a file or data set, safe for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace intervale {

// Replaces each control character by '?': line breaks, escapes, DEL, and U+0080 to U+009F, which also begin escape
// sequences. All else is unchanged, including bytes that are not UTF-8.
[[nodiscard]] inline std::string printable(std::string_view text) {
  std::string shown;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]), next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : 0);
    const bool two = c == 0xc2 && next >= 0x80 && next < 0xa0;
    shown += two || c < 0x20 || c == 0x7f ? '?' : text[i];
    i += two ? 1 : 0;
  }
  return shown;
}

}  // namespace intervale
