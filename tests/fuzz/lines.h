// What fuzz targets of texts share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/split.h"

namespace intervale::testing {

// Ends the program, as a finding, where a law does not hold.
inline void require(bool holds, const char* law) {
  if (holds) return;
  std::fprintf(stderr, "does not hold: %s\n", law);
  std::abort();
}

// Exactly `count` strings: what stands before each line break, the last with all that is left. Those that are not there
// are empty.
inline std::vector<std::string> lines_of(const std::uint8_t* data, std::size_t size, std::size_t count) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::vector<std::string> lines(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto end = i + 1 < count ? rest.find('\n') : std::string_view::npos;
    lines[i] = rest.substr(0, end);
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  }
  return lines;
}

// What stands between separators, without blanks around; at least one.
inline std::vector<std::string> split_trimmed(std::string_view text, char separator) {
  std::vector<std::string> parts = split(text, separator);
  for (std::string& part : parts) {
    while (!part.empty() && (part.back() == ' ' || part.back() == '\t')) part.pop_back();
    part.erase(0, part.find_first_not_of(" \t"));
  }
  return parts;
}

}  // namespace intervale::testing
