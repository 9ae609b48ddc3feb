#include "common/codec/value_prediction.h"

#include <algorithm>
#include <bit>
#include <cstdlib>

namespace intervale {
namespace {

constexpr int kWeightBits = 8;  // of a pair's difference

// The weight of a pair by its difference: as the inverse of the difference squared.
constexpr std::array<std::uint32_t, 1 << kWeightBits> kPairWeights = [] {
  std::array<std::uint32_t, 1 << kWeightBits> weights{};
  for (std::uint32_t d = 0; d < weights.size(); ++d) weights[d] = 65536 / (d * d + 4);
  return weights;
}();

struct Pair {
  std::int64_t sum, difference;
};

// The same as predictor_values(), for a class that the compiler knows: loops of fixed length take half the time.
template <int Class>
inline PredictorValues values_of(const VertexKeys& keys, const KeySpan& span) {
  constexpr std::size_t kHalf = (kVerticesOfClass[Class] - 2) / 2, kPairs = kHalf + 1;
  std::array<Pair, kPairs> pair;
  std::int64_t widest = (1 << kWeightBits) - 1;
  for (std::size_t i = 0; i < kPairs; ++i) {
    const std::int64_t a = keys[i == 0 ? 0 : 1 + i], b = keys[i == 0 ? 1 : 1 + i + kHalf];
    pair[i] = {a + b, std::abs(a - b)};
    widest = std::max(widest, pair[i].difference);
  }
  const int shift = int(std::bit_width(std::uint64_t(widest))) - kWeightBits;
  std::uint64_t weights = 0, sum = 0;
  for (const Pair& p : pair) {
    const std::uint64_t weight = kPairWeights[std::size_t(p.difference >> shift)];
    weights += weight;
    sum += weight * std::uint64_t(p.sum);
  }
  const auto mean = std::int64_t(8 * sum / weights);
  PredictorValues values;
  values.spine = 8 * pair[0].sum;
  if constexpr (Class == 0) {
    values.difference[0] = (pair[1].sum + pair[2].sum + pair[3].sum) * 8 / 3 - values.spine;
  } else if constexpr (Class == 1) {  // the belt is far, near, far, near
    values.difference[0] = 8 * pair[2].sum - values.spine;
    values.difference[1] = 8 * pair[1].sum - values.spine;
  } else {  // near, far, ...
    values.difference[0] = 4 * (pair[1].sum + pair[3].sum) - values.spine;
    values.difference[1] = 4 * (pair[2].sum + pair[4].sum) - values.spine;
  }
  values.difference[2] = mean - values.spine;
  std::int64_t disagreement = 0;
  for (const Pair& p : pair) disagreement += std::abs(8 * p.sum - mean);
  values.activity = std::uint64_t(disagreement) + 4 * std::uint64_t(kPairs) * (span.greatest - span.least);
  return values;
}

inline Prediction prediction_of(const PredictorValues& values, const PredictorWeights& weights, ValueKey last) {
  std::int64_t more = 128;
  for (std::size_t i = 0; i < kPredictors; ++i) more += weights[i] * values.difference[i];
  const std::int64_t sixteenths = values.spine + (more >> 8) + 8;
  return {ValueKey(std::clamp<std::int64_t>(sixteenths >> 4, 0, last)), std::uint8_t(sixteenths >> 2 & 3)};
}

inline int level_of(std::uint64_t activity) {
  const int octave = int(std::bit_width(activity + 1)) - 1;
  const bool upper = (activity + 1) << (63 - octave) >= 0xb504f333f9de6485u;  // 2^63.5
  return std::min(2 * octave + int(upper), kActivityLevels - 1);
}

}  // namespace

PredictorValues predictor_values(int cls, const VertexKeys& keys) {
  return cls == 0 ? values_of<0>(keys, span_of<0>(keys)) : cls == 1 ? values_of<1>(keys, span_of<1>(keys)) : values_of<2>(keys, span_of<2>(keys));
}

Prediction predict(const PredictorValues& values, const PredictorWeights& weights, ValueKey last) { return prediction_of(values, weights, last); }

int activity_level(std::uint64_t activity) { return level_of(activity); }

template <int Class>
PredictedValue predict_value(const VertexKeys& around, const KeySpan& span, const PredictorWeights& weights, ValueKey last) {
  const PredictorValues values = values_of<Class>(around, span);
  const Prediction prediction = prediction_of(values, weights, last);
  const int level = level_of(values.activity);
  return {prediction.key, std::uint8_t(level), level < kSharpLevels ? prediction.quarter : std::uint8_t(0)};
}
template PredictedValue predict_value<0>(const VertexKeys&, const KeySpan&, const PredictorWeights&, ValueKey);
template PredictedValue predict_value<1>(const VertexKeys&, const KeySpan&, const PredictorWeights&, ValueKey);
template PredictedValue predict_value<2>(const VertexKeys&, const KeySpan&, const PredictorWeights&, ValueKey);

PredictedValue predict_value(int cls, int scale, const VertexKeys& around, const ValueWeights& weights, ValueKey last) {
  const PredictorWeights& w = weights.of[std::size_t(scale)][std::size_t(cls)];
  return cls == 0   ? predict_value<0>(around, span_of<0>(around), w, last)
         : cls == 1 ? predict_value<1>(around, span_of<1>(around), w, last)
                    : predict_value<2>(around, span_of<2>(around), w, last);
}

}  // namespace intervale
