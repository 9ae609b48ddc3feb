// Helpers for parsing HTTP header fields.
#pragma once

#include <boost/beast/core/string.hpp>
#include <string_view>

namespace intervale {

[[nodiscard]] inline std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

// Removes the text up to the separator, and the separator, from `rest`; returns the text, trimmed.
[[nodiscard]] inline std::string_view split_off(std::string_view& rest, char separator) {
  const auto end = rest.find(separator);
  const std::string_view item = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return trimmed(item);
}

using boost::beast::iequals;  // without case

}  // namespace intervale
