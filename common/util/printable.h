// Text from outside, for a terminal or a log: whoever chose a file's or a data set's name must not choose what a terminal does.
#pragma once

#include <string>
#include <string_view>

namespace intervale {

// Control characters are '?' each: line breaks, escapes, DEL, and those of U+0080 to U+009F, which begin escapes too. All else stays as it is, what
// is no UTF-8 too.
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
