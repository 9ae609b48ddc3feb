// Which few errors stand for all of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace intervale {

// At most `most` values (2 or more), ascending, the last one the largest error: each error rounds up to the first that is not smaller. All distinct
// errors if there are no more; else chosen so that rounding adds as small a share as can be to the number of errors above any threshold. O(n log n),
// on all cores that oneTBB may use.
[[nodiscard]] std::vector<float> choose_error_levels(std::span<const float> errors, std::size_t most);

// Finds the level of an error.
class LevelFinder {
 public:
  explicit LevelFinder(std::span<const float> levels);  // ascending; must outlive it

  // The first level that is not smaller; there is one. error >= 0. O(1) where levels are spread out like their numbers as floats.
  [[nodiscard]] std::size_t operator()(float error) const {
    std::size_t i = first_[bucket(error)];
    while (levels_[i] < error) ++i;
    return i;
  }

 private:
  static constexpr std::size_t kBuckets = 4096;
  // Numbers as floats: not negative ones ascend like their bits.
  [[nodiscard]] std::size_t bucket(float error) const;
  std::span<const float> levels_;
  std::uint32_t low_ = 0;
  int shift_ = 0;
  std::vector<std::uint16_t> first_;  // level of each bucket
};

}  // namespace intervale
