#include "server/builder/sample_range.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "common/patch/visit_samples.h"

namespace intervale {
SampleRange sample_range(const Volume& volume) {
  using Indices = tbb::blocked_range<std::size_t>;
  return visit_samples(volume, []<class T>(std::span<const T> samples) {
    const auto widened = [&](const Indices& part, std::array<T, 2> range) {
      for (std::size_t i = part.begin(); i < part.end(); ++i) range = {std::min(range[0], samples[i]), std::max(range[1], samples[i])};
      return range;
    };
    const auto joined = [](const std::array<T, 2>& a, const std::array<T, 2>& b) {
      return std::array<T, 2>{std::min(a[0], b[0]), std::max(a[1], b[1])};
    };
    const auto range = tbb::parallel_reduce(Indices(0, samples.size(), kSamplesAtOnce), std::array<T, 2>{samples[0], samples[0]}, widened, joined);
    return SampleRange{double(range[0]) + 0.0, double(range[1]) + 0.0};
  });
}

}  // namespace intervale
