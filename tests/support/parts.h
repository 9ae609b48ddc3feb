// An interval volume taken apart, for tests that put it together wrongly.
#pragma once

#include "common/ivm/interval_volume.h"

namespace intervale::testing {

// By update; empty if they are not known.
inline std::vector<std::uint8_t> slopes_of(const IntervalVolume& v) {
  std::vector<std::uint8_t> slopes;
  for (UpdateIndex i{0}; v.relevant().has_slopes() && i < v.size(); ++i) slopes.push_back(std::uint8_t(v.relevant().slope(i)));
  return slopes;
}

inline IntervalVolume::Parts parts_of(const IntervalVolume& v) {
  return {v.description(),
          v.set(),
          v.keys(),
          {v.steps().begin(), v.steps().end()},
          {v.error_steps().begin(), v.error_steps().end()},
          {{v.relevant().error_to_distance().begin(), v.relevant().error_to_distance().end()}, slopes_of(v)}};
}

}  // namespace intervale::testing
