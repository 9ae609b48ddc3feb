#include "server/build/error_levels.h"

#include <algorithm>
#include <cassert>
#include <functional>

namespace intervale {
namespace {

// Levels such that each one's errors, rank by rank from the largest, are at most a share of those above it. `errors` descends.
std::vector<float> levels_for(const std::vector<float>& errors, double share, std::size_t most) {
  std::vector<float> levels;
  std::size_t i = 0;
  while (i < errors.size()) {
    if (levels.size() == most) return {};
    levels.push_back(errors[i]);
    i = std::max(i + 1, i + std::size_t(double(i) * share));
    while (i < errors.size() && errors[i] == levels.back()) ++i;
  }
  return levels;
}

}  // namespace

std::vector<float> choose_error_levels(std::span<const float> errors, std::size_t most) {
  assert(most >= 2 && "one level for the largest error, one for all others");
  std::vector<float> sorted(errors.begin(), errors.end());
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  std::vector<float> best = levels_for(sorted, 0, most);
  if (best.empty() && !sorted.empty()) {
    double low = 0, high = 1;
    while (levels_for(sorted, high, most).empty()) high *= 2;
    for (int i = 0; i < 20; ++i) {
      const double middle = (low + high) / 2;
      (levels_for(sorted, middle, most).empty() ? low : high) = middle;
    }
    best = levels_for(sorted, high, most);
  }
  std::reverse(best.begin(), best.end());
  return best;
}

}  // namespace intervale
