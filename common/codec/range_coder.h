// Adaptive binary range coder.
//
// G. N. N. Martin, "Range encoding: an algorithm for removing redundancy from a digitised message", 1979; adaptive bit
// models as in Igor Pavlov's LZMA. Encoder and decoder share each model's code: its function takes either coder and a
// value. An encoder writes the value and returns it; a decoder ignores it and returns the value read.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace intervale {

// An estimate of the probability that a bit is 0, in 1/65536: the mean of the bits so far, of the last few dozen at
// most.
class BitModel {
 public:
  [[nodiscard]] std::uint32_t of_zero() const { return zero_; }
  void learn(bool bit) {
    if (bit) {
      zero_ = std::uint16_t(zero_ - (zero_ * kRates[seen_] >> 16));
    } else {
      zero_ = std::uint16_t(zero_ + ((65536 - zero_) * kRates[seen_] >> 16));
    }
    seen_ = std::uint8_t(seen_ + unsigned(seen_ < kRates.size() - 1));
  }
  // The same without a branch.
  void learn_even(bool bit) {
    const std::uint32_t zeros = std::uint32_t(bit) - 1, zero = zero_;  // all bits set if the probability grows
    const std::uint32_t change = ((zero ^ zeros) - zeros + (65536 & zeros)) * kRates[seen_] >> 16;
    zero_ = std::uint16_t(zero - ((change ^ zeros) - zeros));
    seen_ = std::uint8_t(seen_ + unsigned(seen_ < kRates.size() - 1));
  }

 private:
  static constexpr std::array<std::uint32_t, 63> kRates = [] {  // 65536 / (n + 1.5)
    std::array<std::uint32_t, 63> rates{};
    for (std::uint32_t n = 0; n < rates.size(); ++n) rates[n] = 2 * 65536 / (2 * n + 3);
    return rates;
  }();
  std::uint16_t zero_ = 1 << 15;
  std::uint8_t seen_ = 0;
};

// A coder that is a local variable keeps its numbers in registers, as long as the compiler inlines what codes with it:
// so no function gets its address.
class RangeEncoder {
 public:
  bool bit(BitModel& model, bool value) {
    const std::uint64_t split = (range_ >> 16) * model.of_zero();
    model.learn(value);
    narrow(value ? split : 0, value ? range_ - split : split);
    return value;
  }
  // The same without a branch: for a bit that is 0 about as often as 1, which no processor foresees.
  bool even_bit(BitModel& model, bool value) {
    const std::uint64_t split = (range_ >> 16) * model.of_zero(), ones = 0 - std::uint64_t(value);
    model.learn_even(value);
    narrow(split & ones, split + ((range_ - 2 * split) & ones));
    return value;
  }
  unsigned raw_bits(int count, unsigned value) {  // without a model, highest first
    for (int i = count; i-- > 0;) {
      const std::uint64_t half = range_ >> 1, ones = 0 - std::uint64_t(value >> i & 1);
      narrow(half & ones, half + (range_ & ones & 1));
    }
    return value;
  }
  // Returns the bytes, a multiple of four. Call it once, last.
  [[nodiscard]] std::vector<std::uint8_t> finish() {
    // Some number in [low_, low_ + range_) whose lower half is 0.
    const std::uint64_t rounded = low_ + 0xffffffffu;
    if (rounded < low_) carry(*out_);
    append(*out_, std::uint32_t(rounded >> 32));
    return std::move(*out_);
  }

 private:
  using Bytes = std::vector<std::uint8_t>;
  void narrow(std::uint64_t from, std::uint64_t range) {
    low_ += from;
    if (low_ < from) carry(*out_);
    range_ = range;
    if (range_ >> 32 != 0) return;
    append(*out_, std::uint32_t(low_ >> 32));
    low_ <<= 32;
    range_ <<= 32;
  }
  static void carry(Bytes& out);
  static void append(Bytes& out, std::uint32_t word);  // highest byte first
  std::uint64_t low_ = 0, range_ = ~std::uint64_t(0);  // range_ >= 2^32 between bits
  std::unique_ptr<Bytes> out_ = std::make_unique<Bytes>();
};

// Decodes bytes from outside: any bytes give some bits. Never reads beyond their end.
class RangeDecoder {
 public:
  explicit RangeDecoder(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
    code_ = std::uint64_t(next()) << 32;
    code_ |= next();
  }
  bool bit(BitModel& model, bool = false) {
    const std::uint64_t split = (range_ >> 16) * model.of_zero();
    const bool value = code_ >= split;
    model.learn(value);
    narrow(value ? split : 0, value ? range_ - split : split);
    return value;
  }
  bool even_bit(BitModel& model, bool = false) {
    const std::uint64_t split = (range_ >> 16) * model.of_zero();
    const bool value = code_ >= split;
    const std::uint64_t ones = 0 - std::uint64_t(value);
    model.learn_even(value);
    narrow(split & ones, split + ((range_ - 2 * split) & ones));
    return value;
  }
  unsigned raw_bits(int count, unsigned = 0) {
    unsigned value = 0;
    for (; count > 0; --count) {
      const std::uint64_t half = range_ >> 1;
      const bool one = code_ >= half;
      const std::uint64_t ones = 0 - std::uint64_t(one);
      narrow(half & ones, half + (range_ & ones & 1));
      value = 2 * value + unsigned(one);
    }
    return value;
  }
  // Whether more was read than the bytes hold; whether exactly all of them were read.
  [[nodiscard]] bool is_overdrawn() const { return at_ > bytes_.size() + 4; }
  [[nodiscard]] bool is_spent() const { return at_ == bytes_.size() + 4; }

 private:
  void narrow(std::uint64_t from, std::uint64_t range) {
    code_ -= from;
    range_ = range;
    if (range_ >> 32 != 0) return;
    range_ <<= 32;
    code_ = code_ << 32 | next();
  }
  std::uint32_t next() {  // four bytes; zeros after the end, of which the first four are allowed
    std::uint32_t word = 0;
    for (std::size_t i = at_; i < at_ + 4; ++i) word = word << 8 | (i < bytes_.size() ? bytes_[i] : 0u);
    at_ += 4;
    return word;
  }
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  std::uint64_t code_ = 0, range_ = ~std::uint64_t(0);
};

// A number of a few bits; each bit's model depends on the bits above it.
template <int Bits>
struct NumberModel {
  std::array<BitModel, std::size_t(1) << Bits> model;

  template <class Coder>
  unsigned code(Coder& coder, unsigned value = 0) {
    unsigned path = 1;
    for (int i = Bits; i-- > 0;) path = 2 * path + unsigned(coder.bit(model[path], (value >> i & 1) != 0));
    return path - (1u << Bits);
  }
};

// A number n from 0 to 2^16 - 2 that is mostly small: how many bits n + 1 has, the two below the highest, and the rest
// as raw bits.
struct SmallNumberModel {
  std::array<BitModel, 16> longer;
  std::array<std::array<BitModel, 4>, 16> below;

  template <class Coder>
  unsigned code(Coder& coder, unsigned value = 0) {
    const int length = std::bit_width(value + 1) - 1;  // below the highest bit
    int n = 0;
    while (n < 15 && coder.bit(longer[n], n < length)) ++n;
    unsigned number = 1;
    for (int i = n; i-- > 0;) {
      if (n - i > 2) {
        number = number << (i + 1) | coder.raw_bits(i + 1, (value + 1) & ((2u << i) - 1));
        break;
      }
      number = 2 * number + unsigned(coder.bit(below[n][number & 3], ((value + 1) >> i & 1) != 0));
    }
    return number - 1;
  }
};

}  // namespace intervale
