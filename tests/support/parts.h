// An interval volume taken apart, for tests that put it together wrongly.
#pragma once

#include "common/ivm/interval_volume.h"

namespace intervale::testing {

inline IntervalVolume::Parts parts_of(const IntervalVolume& v) {
  return {v.description(),
          v.set(),
          {v.codes().begin(), v.codes().end()},
          {v.residuals().begin(), v.residuals().end()},
          {v.error_levels().begin(), v.error_levels().end()},
          {v.yields().begin(), v.yields().end()}};
}

}  // namespace intervale::testing
