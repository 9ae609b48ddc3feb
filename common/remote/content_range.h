// The header Content-Range (RFC 9110, section 14.4), as a server sends it.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>

namespace intervale {

struct ContentRange {
  std::uint64_t first = 0, last = 0;  // both included, first <= last < total
  std::uint64_t total = 0;            // of the whole file
};

// "bytes 0-99/1234". nullopt: anything else, also a total that the server does not know (*).
[[nodiscard]] inline std::optional<ContentRange> parse_content_range(std::string_view text) {
  constexpr std::string_view kUnit = "bytes ";
  if (!text.starts_with(kUnit)) return {};
  text.remove_prefix(kUnit.size());
  ContentRange range;
  // A number, and the character that ends it; '\0': the end of the text.
  const auto take = [&text](std::uint64_t& number, char end) {
    const auto [stop, failure] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (failure != std::errc()) return false;
    text.remove_prefix(std::size_t(stop - text.data()));
    if (end == '\0') return text.empty();
    if (!text.starts_with(end)) return false;
    text.remove_prefix(1);
    return true;
  };
  if (!take(range.first, '-') || !take(range.last, '/') || !take(range.total, '\0')) return {};
  if (range.first > range.last || range.last >= range.total) return {};
  return range;
}

}  // namespace intervale
