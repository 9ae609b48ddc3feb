// The keys of many values (value_format.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/patch/value_format.h"

namespace intervale {

// Keys by number, in as many bytes each as the greatest one needs.
class ValueKeys {
 public:
  ValueKeys() = default;
  ValueKeys(std::size_t size, ValueKey last) : width_(last < 1u << 8 ? 1 : last < 1u << 16 ? 2 : last < 1u << 24 ? 3 : 4), bytes_(size * width_) {}
  [[nodiscard]] unsigned width() const { return width_; }  // bytes a key
  [[nodiscard]] std::size_t size() const { return bytes_.size() / width_; }
  [[nodiscard]] ValueKey operator[](std::size_t i) const {
    const std::uint8_t* const at = bytes_.data() + i * width_;
    return width_ == 1 ? read<1>(at) : width_ == 2 ? read<2>(at) : width_ == 3 ? read<3>(at) : read<4>(at);
  }
  // The key at some of its bytes, for a width that the compiler knows.
  template <unsigned Width>
  [[nodiscard]] static ValueKey read(const std::uint8_t* at) {
    ValueKey key = at[0];
    if constexpr (Width > 1) key |= ValueKey(at[1]) << 8;
    if constexpr (Width > 2) key |= ValueKey(at[2]) << 16;
    if constexpr (Width > 3) key |= ValueKey(at[3]) << 24;
    return key;
  }
  void set(std::size_t i, ValueKey key) {
    for (unsigned b = 0; b < width_; ++b) bytes_[i * width_ + b] = std::uint8_t(key >> (8 * b));
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }  // little endian
  [[nodiscard]] std::span<std::uint8_t> bytes() { return bytes_; }              // to be set
  [[nodiscard]] std::size_t memory_bytes() const { return bytes_.size(); }

 private:
  unsigned width_ = 1;
  std::vector<std::uint8_t> bytes_;
};

using ChannelKeys = std::vector<ValueKeys>;  // of a channel (channel.h), by component

}  // namespace intervale
