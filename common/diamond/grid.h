// Where the samples of a regular volume lie.
#pragma once

#include <array>
#include <cstdint>

#include "common/diamond/affine.h"

namespace intervale {

inline constexpr std::int32_t kMinSide = 2;        // samples on an axis, fewest
inline constexpr std::int32_t kMaxSide = 1 << 20;  // samples on an axis, most

// A regular grid of samples. Sample (i, j, k), 0 <= i < dims[0] and so on, lies at affine.point({i, j, k}) in the world.
struct Grid {
  std::array<std::int32_t, 3> dims{};
  Affine affine;

  [[nodiscard]] std::uint64_t sample_count() const { return std::uint64_t(dims[0]) * std::uint64_t(dims[1]) * std::uint64_t(dims[2]); }
  friend bool operator==(const Grid&, const Grid&) = default;
};

}  // namespace intervale
