// Makes untrusted text, such as the name of a file or data set, safe for a terminal or a log.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace intervale {

// The bytes of the control character that a text begins with: line breaks, escapes, DEL, and U+0080 to U+009F, which
// also begin escape sequences. 0: it begins with another character, or is empty.
[[nodiscard]] inline std::size_t control_size(std::string_view text) {
  const auto byte = [text](std::size_t i) { return static_cast<unsigned char>(i < text.size() ? text[i] : ' '); };
  if (byte(0) < 0x20 || byte(0) == 0x7f) return 1;
  return byte(0) == 0xc2 && byte(1) >= 0x80 && byte(1) < 0xa0 ? 2 : 0;
}

// The bytes of the character that a text begins with, if it changes how the text around it is read, and is not seen
// itself: those that reverse the direction (U+061C, U+200E, U+200F, U+202A to U+202E, U+2066 to U+2069), separators of
// lines (U+2028, U+2029), and others of no width (U+200B, U+2060 to U+206F, U+FEFF). Not U+200C and U+200D, which join
// letters: Persian and the languages of India are not spelled without them. 0: it begins with another character.
[[nodiscard]] inline std::size_t hidden_size(std::string_view text) {
  if (text.starts_with("\xd8\x9c")) return 2;
  if (text.starts_with("\xef\xbb\xbf")) return 3;
  if (text.size() < 3 || text[0] != '\xe2') return 0;
  const auto second = static_cast<unsigned char>(text[1]), third = static_cast<unsigned char>(text[2]);
  if (second == 0x81) return third >= 0xa0 && third <= 0xaf ? 3 : 0;
  if (second != 0x80) return 0;
  return third == 0x8b || third == 0x8e || third == 0x8f || (third >= 0xa8 && third <= 0xae) ? 3 : 0;
}

[[nodiscard]] inline bool has_control_characters(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (control_size(text.substr(i)) > 0) return true;
  }
  return false;
}

// Replaces each of both kinds by '?'. All else is unchanged, including bytes that are not UTF-8.
[[nodiscard]] inline std::string printable(std::string_view text) {
  std::string shown;
  shown.reserve(text.size());
  while (!text.empty()) {
    const std::size_t control = control_size(text), size = control > 0 ? control : hidden_size(text);
    shown += size > 0 ? '?' : text.front();
    text.remove_prefix(size > 0 ? size : 1);
  }
  return shown;
}

}  // namespace intervale
