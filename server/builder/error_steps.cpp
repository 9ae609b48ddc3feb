#include "server/builder/error_steps.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <functional>
#include <utility>

namespace intervale {
namespace {

// Floats that are not negative compare like their bits.
std::uint32_t bits_of(float error) { return std::bit_cast<std::uint32_t>(error); }

// Descending. First into buckets by the upper half of their bits, then bucket by bucket.
std::vector<float> sorted(std::span<const float> errors) {
  std::vector<std::size_t> end(1 << 16);
  for (float e : errors) ++end[bits_of(e) >> 16];
  std::size_t next = 0;
  for (std::size_t b = end.size(); b-- > 0;) next += std::exchange(end[b], next);
  std::vector<float> result(errors.size());
  for (float e : errors) result[end[bits_of(e) >> 16]++] = e;
  tbb::parallel_for(std::size_t(0), end.size(), [&](std::size_t b) {
    const std::size_t begin = b + 1 < end.size() ? end[b + 1] : 0;
    std::sort(result.begin() + std::ptrdiff_t(begin), result.begin() + std::ptrdiff_t(end[b]), std::greater<>());
  });
  return result;
}

// Steps such that each one's errors, in descending order, are at most a share of the number of those above it; none if
// that takes more than `most`. `errors` descends.
std::vector<float> steps_for(const std::vector<float>& errors, double share, std::size_t most) {
  std::vector<float> steps;
  std::size_t i = 0;
  while (i < errors.size()) {
    if (steps.size() == most) return {};
    steps.push_back(errors[i]);
    const auto smaller = std::upper_bound(errors.begin() + std::ptrdiff_t(i), errors.end(), errors[i], std::greater<>());
    i = std::max(i + std::size_t(double(i) * share), std::size_t(smaller - errors.begin()));
  }
  return steps;
}

}  // namespace

std::vector<float> choose_error_steps(std::span<const float> errors, std::size_t most) {
  assert(most >= 2 && "one step for the largest error, one for all others");
  const std::vector<float> all = sorted(errors);
  std::vector<float> best = steps_for(all, 0, most);
  if (best.empty() && !all.empty()) {
    double low = 0, high = 1;
    while (steps_for(all, high, most).empty()) high *= 2;
    for (int i = 0; i < 20; ++i) {
      const double middle = (low + high) / 2;
      (steps_for(all, middle, most).empty() ? low : high) = middle;
    }
    best = steps_for(all, high, most);
  }
  std::reverse(best.begin(), best.end());
  return best;
}

ErrorStepFinder::ErrorStepFinder(std::span<const float> steps) : steps_(steps), first_(kBuckets) {
  if (steps.empty()) return;
  low_ = bits_of(steps.front());
  while ((bits_of(steps.back()) - low_) >> shift_ >= kBuckets) ++shift_;
  std::size_t i = 0;
  for (std::size_t b = 0; b < kBuckets; ++b) {
    while (i < steps.size() && bucket(steps[i]) < b) ++i;
    first_[b] = std::uint16_t(i);
  }
}

std::size_t ErrorStepFinder::bucket(float error) const {
  const std::uint32_t bits = bits_of(error);
  return bits <= low_ ? 0 : (bits - low_) >> shift_;
}

}  // namespace intervale
