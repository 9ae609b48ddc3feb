// The weights of the prediction of values (common/codec/value_prediction.h), which a data set stores.
#pragma once

#include <array>
#include <cstdint>

#include "common/diamond/diamond.h"

namespace intervale {

inline constexpr int kPredictors = 3;

// Least-squares coefficients of one class and scale, in 1/256.
using PredictorWeights = std::array<std::int16_t, kPredictors>;
struct ValueWeights {
  std::array<std::array<PredictorWeights, 3>, kMaxLevels> of{};  // by scale and class; 0 for scales that a grid has not
  friend bool operator==(const ValueWeights&, const ValueWeights&) = default;
};

}  // namespace intervale
