// The formulas of the sample volumes, row by row.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

namespace intervale {

// Computes row (j, k): a sample at every place along x. out: as many numbers. Any thread.
using SampleRow = std::function<void(std::size_t j, std::size_t k, std::span<double> out)>;

struct SampleFormula {
  std::string_view name;
  // The range that its values nominally have; they may exceed it a little.
  double least = 0, greatest = 0;
  // places: of the samples, the same along each axis. Takes O(places) of memory.
  SampleRow (*rows)(const std::vector<double>& places);
};

// In the order of sample_names().
[[nodiscard]] std::span<const SampleFormula> sample_formulas();

}  // namespace intervale
