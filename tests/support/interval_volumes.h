// Interval volumes of volumes made by formula.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"

namespace intervale::testing {

using Dims = std::array<std::int32_t, 3>;

inline IntervalVolume build(const Volume& volume, const BuildOptions& options) {
  auto sigma = FieldHierarchy(volume, options).compact();
  EXPECT_TRUE(sigma) << sigma.error().message;
  return std::move(*sigma);
}

inline std::shared_ptr<const IntervalVolume> build_shared(const Volume& volume, const BuildOptions& options) {
  return std::make_shared<const IntervalVolume>(build(volume, options));
}

// The volume with cells that are no cubes, in a box that does not begin at the world's origin.
inline Volume stretched(Volume volume) {
  volume.grid.affine = Affine::of({0.5, 1, 3}, {-4, 0, 7});
  return volume;
}

// For laws that hold for any volume: a gyroid for even seeds, random digits for odd ones, in one of the given boxes.
struct Trial {
  Volume volume;
  BuildOptions options;
};
inline Trial trial_of_seed(unsigned seed, std::span<const Dims> boxes) {
  const Dims& dims = boxes[seed / 2 % boxes.size()];
  if (seed % 2 == 0) return {gyroid(dims), {.range = {-0.3, 0.2}}};
  return {digits(dims, seed), {.range = {3, 5.5}}};
}
inline IntervalVolume build(const Trial& trial) { return build(trial.volume, trial.options); }

}  // namespace intervale::testing
