// Times of things that are compared: each run of one is followed by a run of the other, and the medians count.
#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <vector>

namespace intervale::bench {

// Seconds that `work` takes. What it returns is destroyed outside of them.
template <class Work>
double seconds(Work&& work) {
  const auto start = std::chrono::steady_clock::now();
  [[maybe_unused]] const auto result = work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

[[nodiscard]] inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? 0 : (values[(n - 1) / 2] + values[n / 2]) / 2;
}

// The median seconds of each of `work`, which are run in turn `runs` times.
template <class... Work>
std::array<double, sizeof...(Work)> alternate(int runs, Work&&... work) {
  std::array<std::vector<double>, sizeof...(Work)> times;
  for (int i = 0; i < runs; ++i) {
    std::size_t k = 0;
    (times[k++].push_back(seconds(work)), ...);
  }
  std::array<double, sizeof...(Work)> medians;
  std::transform(times.begin(), times.end(), medians.begin(), median);
  return medians;
}

}  // namespace intervale::bench
