// Formats numbers.
#pragma once

#include <array>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <type_traits>
#include <version>

namespace intervale {

// The shortest decimal that parses to the same value. The result points into `digits`.
template <class T>
std::string_view decimal(T value, std::array<char, 32>& digits) {
#ifndef __cpp_lib_to_chars
  if constexpr (std::is_floating_point_v<T>) {  // libc++ of Emscripten has to_chars for integers only
    int size = 0;
    for (int precision = 1; precision <= 17; ++precision) {
      size = std::snprintf(digits.data(), digits.size(), "%.*g", precision, double(value));
      if (T(std::strtod(digits.data(), nullptr)) == value) break;
    }
    return {digits.data(), std::size_t(size)};
  } else
#endif
    return {digits.data(), std::size_t(std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr - digits.data())};
}

}  // namespace intervale
