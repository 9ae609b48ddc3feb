// What the result of a build depends on, as one number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "common/util/result.h"

namespace intervale {

// Equal for equal calls in the same order. One thread.
class Fingerprint {
 public:
  // Begins with the versions of the program, of the file format, and of what a checkpoint holds.
  Fingerprint();

  template <class T>
  requires std::is_arithmetic_v<T>
  void add(T number) { append(&number, sizeof number); }
  void add(const std::string& text) {
    add(text.size());
    append(text.data(), text.size());
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class T>
  void add(const std::vector<T>& values) {
    add(values.size());
    for (const T& value : values) add(value);
  }

  // The path, size and times of a volume's file, and of the other file that its header names; or of all files in a folder and
  // below, but for those `left_out`, by their absolute paths. Their contents are not read, beyond a header. Fails, in one
  // line, where something of that is not there.
  [[nodiscard]] Result<void> add_input(const std::filesystem::path& input, std::span<const std::filesystem::path> left_out);

  [[nodiscard]] std::uint64_t value() const;

 private:
  void append(const void* bytes, std::size_t count);
  std::string bytes_;
};

}  // namespace intervale
