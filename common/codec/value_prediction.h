// Predicts the value at the centre of a diamond from the values at its vertices, and how far off the prediction may be.
//
// The vertices of a diamond stand around its centre in pairs: the spine's ends, and opposite vertices of the belt. The
// prediction is the mean of the spine, plus weighted differences from it: of the mean of the near belt vertices, of that
// of the far ones, and of a mean of all pairs in which pairs of like values count more. The weights are least-squares
// coefficients, by class and scale, which a data set stores.
//
// Arithmetic is in whole numbers, so that every machine predicts alike. A prediction reads nothing but the diamond's
// vertices, so residuals do not depend on the order in which values arrive.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "common/diamond/diamond.h"
#include "common/patch/value_format.h"
#include "common/patch/value_weights.h"

namespace intervale {

// Keys of a diamond's vertices, by local number. All must be set; fill_missing() sets those that are not known.
using VertexKeys = std::array<ValueKey, kMaxVertices>;
inline constexpr ValueKey kNoKey = ~ValueKey(0);
inline constexpr std::array<std::size_t, 3> kVerticesOfClass{8, 6, 10};  // of a diamond, by its class

// The least and the greatest of some keys.
struct KeySpan {
  ValueKey least = 0, greatest = 0;
  void add(ValueKey key) {
    least = std::min(least, key);
    greatest = std::max(greatest, key);
  }
};
template <int Class>
[[nodiscard]] KeySpan span_of(const VertexKeys& keys) {
  KeySpan span{keys[0], keys[0]};
  for (std::size_t v = 1; v < kVerticesOfClass[Class]; ++v) span.add(keys[v]);
  return span;
}

// Differences from the spine's mean, in 1/16 of a key: near belt, far belt, weighted pairs. Class 0 has no far belt.
struct PredictorValues {
  std::int64_t spine = 0;                              // the spine's mean, in 1/16 of a key
  std::array<std::int64_t, kPredictors> difference{};  // in 1/16 of a key
  std::uint64_t activity = 0;                          // how much the pairs disagree, and how far the vertices spread
};
// cls: the diamond's class, 0 to 2.
[[nodiscard]] PredictorValues predictor_values(int cls, const VertexKeys& keys);

struct Prediction {
  ValueKey key = 0;          // the nearest one, in [0, last]
  std::uint8_t quarter = 0;  // of the half open interval from half a key below to half a key above, 0 to 3
};
[[nodiscard]] Prediction predict(const PredictorValues& values, const PredictorWeights& weights, ValueKey last);

// A class of diamonds whose predictions are about equally far off: the activity in half octaves, at most
// kActivityLevels - 1.
inline constexpr int kActivityLevels = 40;
[[nodiscard]] int activity_level(std::uint64_t activity);

// What is known of a value before it is coded.
struct PredictedValue {
  ValueKey key = 0;          // the prediction
  std::uint8_t level = 0;    // of activity
  std::uint8_t quarter = 0;  // of the prediction; 0 where residuals are so large that it tells nothing
};
inline constexpr int kSharpLevels = 18;  // of activity: where the quarter counts
// cls, scale: of the diamond. around: the keys at its vertices, none of which is kNoKey.
[[nodiscard]] PredictedValue predict_value(int cls, int scale, const VertexKeys& around, const ValueWeights& weights, ValueKey last);
// The same, for a class that the compiler knows, with the span of the keys, and the weights of that class and scale.
template <int Class>
[[nodiscard]] PredictedValue predict_value(const VertexKeys& around, const KeySpan& span, const PredictorWeights& weights, ValueKey last);

// Replaces kNoKey by the mean of the spine, whose ends must be known. vertices: how many the diamond has.
inline void fill_missing(VertexKeys& keys, int vertices) {
  const auto mean = ValueKey((std::uint64_t(keys[0]) + keys[1]) / 2);
  for (int v = 2; v < vertices; ++v) {
    if (keys[std::size_t(v)] == kNoKey) keys[std::size_t(v)] = mean;
  }
}

}  // namespace intervale
