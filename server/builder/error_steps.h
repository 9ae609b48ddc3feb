// Quantises errors to a few values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace intervale {

// At most `most` values (2 or more), ascending; the last one is the largest error. Each error is rounded up to the
// first value that is not smaller. All distinct errors if there are no more than `most`; else chosen so that rounding
// adds the smallest possible fraction to the number of errors above any threshold. O(n log n); uses all cores that
// oneTBB may.
[[nodiscard]] std::vector<float> choose_error_steps(std::span<const float> errors, std::size_t most);

// Finds the step of an error: the index of the value that it is rounded up to.
class ErrorStepFinder {
 public:
  explicit ErrorStepFinder(std::span<const float> steps);  // the values, ascending; must outlive it

  // error: at least 0, at most the last value. O(1) if the values' bits are spread evenly.
  [[nodiscard]] std::size_t operator()(float error) const {
    std::size_t i = first_[bucket(error)];
    while (steps_[i] < error) ++i;
    return i;
  }

 private:
  static constexpr std::size_t kBuckets = 4096;
  // By the bits of the float.
  [[nodiscard]] std::size_t bucket(float error) const;
  std::span<const float> steps_;
  std::uint32_t low_ = 0;
  int shift_ = 0;
  std::vector<std::uint16_t> first_;  // by bucket
};

}  // namespace intervale
