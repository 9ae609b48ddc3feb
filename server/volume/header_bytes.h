// The beginning of a file, and words and numbers in it.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/volume/input_file.h"

namespace intervale {

inline constexpr std::size_t kMaxTextHeader = 1 << 16;  // bytes, of formats that set no limit

// The first bytes of a file: `most`, or fewer if it is shorter.
[[nodiscard]] Result<std::string> read_start(const InputFile& file, std::size_t most);

// A binary header, in either byte order.
class HeaderBytes {
 public:
  HeaderBytes(std::string_view bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  template <class T>
  [[nodiscard]] T number(std::size_t at) const {  // at + sizeof(T) <= size
    assert(at + sizeof(T) <= bytes_.size());
    std::array<char, sizeof(T)> copy;
    std::copy_n(bytes_.begin() + std::ptrdiff_t(at), sizeof(T), copy.begin());
    if (big_endian_) std::reverse(copy.begin(), copy.end());
    T value;
    std::memcpy(&value, copy.data(), sizeof(T));
    return value;
  }
  // A text in a field of this length: up to its first zero byte.
  [[nodiscard]] std::string_view text(std::size_t at, std::size_t length) const {
    const std::string_view field = bytes_.substr(at, length);
    return field.substr(0, field.find('\0'));
  }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

// Without blanks at its ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);
[[nodiscard]] std::string lower(std::string_view text);  // ASCII only

// The number that all of a text is, perhaps after a plus sign; none if it is something else, or too large for T.
template <class T>
[[nodiscard]] std::optional<T> number_of(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  T number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

// The words of a line, between blanks.
[[nodiscard]] std::vector<std::string_view> words_of(std::string_view line);

// The numbers that all words of a line are; none if one is something else, or if they are not as many as N.
template <class T, std::size_t N>
[[nodiscard]] std::optional<std::array<T, N>> numbers_of(std::span<const std::string_view> words) {
  std::array<T, N> numbers{};
  if (words.size() != N) return {};
  for (std::size_t k = 0; k < N; ++k) {
    const auto number = number_of<T>(words[k]);
    if (!number) return {};
    numbers[k] = *number;
  }
  return numbers;
}

}  // namespace intervale
