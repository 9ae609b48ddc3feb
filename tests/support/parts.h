// An interval volume taken apart, for tests that put it together wrongly.
#pragma once

#include "common/ivm/interval_volume.h"

namespace intervale::testing {

inline IntervalVolume::Parts parts_of(const IntervalVolume& v) {
  return {v.description(),
          v.set(),
          v.keys(),
          {v.steps().begin(), v.steps().end()},
          {v.error_steps().begin(), v.error_steps().end()},
          {v.relevant().error_to_distance().begin(), v.relevant().error_to_distance().end()}};
}

}  // namespace intervale::testing
