// The bits of words: as sets of small numbers, and of one type as another.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <iterator>
#include <type_traits>

namespace intervale {

// std::bit_cast, which Emscripten's library lacks.
template <class To, class From>
[[nodiscard]] To bits_as(const From& from) {
  static_assert(sizeof(To) == sizeof(From) && std::is_trivially_copyable_v<To> && std::is_trivially_copyable_v<From>);
  To to;
  std::memcpy(static_cast<void*>(&to), &from, sizeof to);  // of any class that can be copied so
  return to;
}

// The positions of the bits that are set, ascending: for (const int i : set_bits(word)), or set_bits<Slot>(word), which
// makes each a Slot.
template <std::unsigned_integral Word, class Position>
class SetBits {
 public:
  class Iterator {
   public:
    using value_type = Position;
    using difference_type = std::ptrdiff_t;
    constexpr Iterator() = default;
    constexpr explicit Iterator(Word left) : left_(left) {}
    [[nodiscard]] constexpr Position operator*() const { return Position(std::countr_zero(left_)); }
    constexpr Iterator& operator++() {
      left_ &= Word(left_ - 1);
      return *this;
    }
    [[nodiscard]] constexpr bool operator==(std::default_sentinel_t) const { return left_ == 0; }

   private:
    Word left_ = 0;
  };
  constexpr explicit SetBits(Word word) : word_(word) {}
  [[nodiscard]] constexpr Iterator begin() const { return Iterator(word_); }
  [[nodiscard]] static constexpr std::default_sentinel_t end() { return {}; }

 private:
  Word word_;
};

template <class Position = int, std::unsigned_integral Word>
[[nodiscard]] constexpr SetBits<Word, Position> set_bits(Word word) {
  return SetBits<Word, Position>(word);
}

// Moves the bits at the ones of `mask` to the lowest positions, in their order.
[[nodiscard]] std::uint64_t extract_bits(std::uint64_t bits, std::uint64_t mask);

// How many bits below position i are set. i: less than the width of the word.
template <std::unsigned_integral Word>
[[nodiscard]] constexpr int count_below(Word word, int i) {
  return std::popcount(Word(word & ((Word(1) << i) - 1)));
}

}  // namespace intervale
