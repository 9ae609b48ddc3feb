// Codes the residual of a value from its prediction (value_prediction.h), with models by class, scale and activity.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "common/codec/range_coder.h"
#include "common/codec/value_prediction.h"

namespace intervale {

// A whole number of either sign that is mostly small: whether it is 0, its sign, how many bits its size has, the two
// below the highest, and the rest as raw bits. Sizes below 2^33. What is likely may depend on a quarter, 0 to 3.
struct SignedModel {
  static constexpr int kLengths = 18;            // lengths with models of their own; longer numbers say theirs in raw bits
  std::array<BitModel, 4> is_zero, is_negative;  // by quarter
  std::array<BitModel, kLengths> longer;
  std::array<std::array<BitModel, 3>, kLengths> below;

  template <class Coder>
  std::int64_t code(Coder& coder, std::int64_t value = 0, std::uint8_t quarter = 0) {
    if (coder.bit(is_zero[quarter], value == 0)) return 0;
    const bool negative = coder.even_bit(is_negative[quarter], value < 0);
    const std::int64_t sign = -std::int64_t(negative);
    const auto size = std::uint64_t((value ^ sign) - sign);  // without a branch
    const int length = int(std::bit_width(size)) - 1;        // below the highest bit
    int n = 0;
    while (n < kLengths && coder.bit(longer[std::size_t(n)], n < length)) ++n;
    std::uint64_t number = 1;
    int left = n;  // bits that are not coded yet
    if (n == kLengths) {
      left += int(coder.raw_bits(4, unsigned(length - kLengths)));
    } else {
      for (unsigned path = 0; left > 0 && left > n - 2;) {
        --left;
        const bool bit = coder.even_bit(below[std::size_t(n)][path], (size >> left & 1) != 0);
        path = 1 + unsigned(bit);
        number = 2 * number + unsigned(bit);
      }
    }
    while (left > 0) {
      const int some = left < 16 ? left : 16;
      left -= some;
      number = number << some | coder.raw_bits(some, unsigned(size >> left) & ((1u << some) - 1));
    }
    return (std::int64_t(number) ^ sign) - sign;
  }
};

// All models of values. A small batch uses few of them, so each is made when it is first used.
class ValueModels {
 public:
  // Codes the key of a diamond's centre from those of its vertices, none of which is kNoKey. `key` matters to an encoder
  // only. A decoder may return a key that is greater than `last`, or wrap, if its bytes are damaged.
  template <class Coder>
  ValueKey code(Coder& coder, int cls, int scale, const VertexKeys& around, const ValueWeights& weights, ValueKey last, ValueKey key = 0) {
    return code(coder, cls, scale, predict_value(cls, scale, around, weights, last), key);
  }
  // The same, after the prediction.
  template <class Coder>
  ValueKey code(Coder& coder, int cls, int scale, const PredictedValue& predicted, ValueKey key = 0) {
    SignedModel& model = of(cls, scale, predicted.level);
    const std::int64_t coded = std::int64_t(predicted.key) + model.code(coder, std::int64_t(key) - std::int64_t(predicted.key), predicted.quarter);
    return coded < 0 || coded > std::int64_t(kNoKey) ? kNoKey : ValueKey(coded);
  }
  // Of the residuals of diamonds with this level of activity.
  SignedModel& of(int cls, int scale, std::uint8_t level) {
    auto& model = of_[std::size_t(cls)][scale == 0][level];
    if (!model) make(model);
    return *model;
  }

 private:
  [[gnu::noinline]] static void make(std::optional<SignedModel>& model) { model.emplace(); }  // seldom
  // By class, whether the scale is 0, activity.
  std::array<std::array<std::array<std::optional<SignedModel>, kActivityLevels>, 2>, 3> of_;
};

}  // namespace intervale
