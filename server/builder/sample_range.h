// The least and the greatest sample of a volume.
#pragma once

#include <cstddef>

#include "common/patch/volume.h"

namespace intervale {

inline constexpr std::size_t kSamplesAtOnce = 1 << 14;  // that a thread takes

struct SampleRange {
  double least = 0, greatest = 0;  // never -0
};

// samples: finite, at least one. O(n); uses all cores that oneTBB may.
[[nodiscard]] SampleRange sample_range(const Volume& volume);

}  // namespace intervale
