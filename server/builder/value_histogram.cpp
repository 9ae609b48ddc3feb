#include "server/builder/value_histogram.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "common/patch/visit_samples.h"
#include "server/builder/sample_range.h"
#include "server/builder/value_steps.h"

namespace intervale {
namespace {

using Counts = std::array<std::uint64_t, kMostBins>;

// bin_of: of a sample; less than kMostBins.
template <class T, class BinOf>
Counts count(std::span<const T> samples, const BinOf& bin_of) {
  tbb::enumerable_thread_specific<Counts> all(Counts{});
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, samples.size(), kSamplesAtOnce), [&](const auto& part) {
    Counts& counts = all.local();
    for (std::size_t i = part.begin(); i < part.end(); ++i) ++counts[bin_of(samples[i])];
  });
  Counts sum{};
  for (const Counts& counts : all) std::transform(sum.begin(), sum.end(), counts.begin(), sum.begin(), std::plus<>());
  return sum;
}

// Bins of `keys` keys each.
Counts count_keys(const Volume& volume, const ValueFormat& format, ValueKey keys) {
  return visit_samples(volume, [&]<class T>(std::span<const T> samples) {
    return count(samples, [&](T v) -> std::size_t { return key_of_sample(format, v) / keys; });
  });
}

}  // namespace

ValueHistogram make_value_histogram(const Volume& volume, const ValueFormat& format) {
  const double least = format.least(), greatest = format.greatest();
  ValueHistogram result{least, 1, {}};
  Counts counts{};
  std::size_t bins = 1;
  if (format.step == 0 && format.last > 0) {
    const double half = std::isfinite(greatest - least) ? 1 : 0.5;  // the difference of two doubles can overflow
    const double span = greatest * half - least * half;
    double width = span / double(kMostBins);
    if (width * double(kMostBins) < span) width = std::nextafter(width, span);  // of few of the smallest doubles
    bins = std::min(kMostBins, std::size_t(span / width) + 1);
    result.width = width / half;
    counts = visit_samples(volume, [&](auto samples) {
      return count(samples, [&](auto v) {
        const double value = format.value(key_of_sample(format, v));
        return std::min(bins - 1, std::size_t((value * half - least * half) / width));
      });
    });
  } else {
    const auto keys = ValueKey(format.last / kMostBins + 1);
    bins = format.last / keys + 1;
    if (format.step > 0) result.width = format.step * double(keys);
    counts = count_keys(volume, format, keys);
  }
  result.count.assign(counts.begin(), counts.begin() + std::ptrdiff_t(bins));
  return result;
}

}  // namespace intervale
