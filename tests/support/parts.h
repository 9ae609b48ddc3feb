// An interval volume taken apart, for tests that put it together wrongly.
#pragma once

#include "common/ivm/interval_volume.h"
#include "tests/support/needs.h"

namespace intervale::testing {

// By update; empty if they are not known.
inline std::vector<std::uint8_t> slopes_of(const IntervalVolume& v) {
  std::vector<std::uint8_t> slopes;
  if (!v.relevant().has_slopes()) return slopes;
  slopes.resize(v.size());
  v.set().for_each_down([&](const Place& p) { slopes[p.index] = std::uint8_t(slope_of(v.relevant(), v, p)); });
  return slopes;
}

inline IntervalVolume::Parts parts_of(const IntervalVolume& v) {
  return {v.description(),
          v.set(),
          v.keys(),
          {v.steps().begin(), v.steps().end()},
          {v.error_steps().begin(), v.error_steps().end()},
          {error_to_distance_of(v.relevant(), v), slopes_of(v)}};
}

}  // namespace intervale::testing
