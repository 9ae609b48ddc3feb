// Doubles that are no usual numbers.
#pragma once

#include <limits>

namespace intervale {

inline constexpr double kInf = std::numeric_limits<double>::infinity();
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace intervale
