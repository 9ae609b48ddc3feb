// Numbers of different kinds of things, a type for each kind.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace intervale {

// A number of one kind of things; Tag names the kind. It becomes a plain integer implicitly, so that it indexes arrays,
// shifts and compares, but never one of fewer bits; an integer or another kind's number becomes one only explicitly, or
// not at all.
template <class Tag, std::unsigned_integral Rep = std::uint32_t>
class Index {
 public:
  constexpr Index() = default;  // 0
  constexpr explicit Index(std::integral auto value) : value_(Rep(value)) {}
  constexpr operator Rep() const { return value_; }
  template <std::integral T>
  constexpr explicit operator T() const requires(sizeof(T) < sizeof(Rep)) = delete;

  constexpr Index& operator++() {
    ++value_;
    return *this;
  }
  constexpr Index operator++(int) { return Index(value_++); }
  constexpr Index& operator+=(std::integral auto n) { return *this = *this + n; }
  [[nodiscard]] friend constexpr Index operator+(Index index, std::integral auto n) { return Index(index.value_ + Rep(n)); }
  [[nodiscard]] friend constexpr std::size_t hash_value(Index index) { return index.value_; }  // for Boost's containers

 private:
  Rep value_ = 0;
};

}  // namespace intervale
