// The least and the greatest sample of a volume.
#pragma once

#include "server/volume/volume.h"

namespace intervale {

struct SampleRange {
  double least = 0, greatest = 0;  // never -0
};

// samples: finite, at least one. O(n); uses all cores that oneTBB may.
[[nodiscard]] SampleRange sample_range(const Volume& volume);

}  // namespace intervale
