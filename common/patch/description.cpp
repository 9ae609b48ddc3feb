#include "common/patch/description.h"

#include <algorithm>
#include <cmath>

namespace intervale {

Result<void> check_grid(const Grid& grid) {
  for (int i = 0; i < 3; ++i) {
    if (grid.dims[i] < kMinSide || grid.dims[i] > kMaxSide) return fail("a side of " + std::to_string(grid.dims[i]) + " samples is out of bounds");
    const double far = grid.origin[i] + grid.spacing[i] * (grid.dims[i] - 1);
    if (!(grid.spacing[i] > 0) || !std::isfinite(grid.origin[i]) || !std::isfinite(far)) return fail("spacing or origin is out of bounds");
  }
  return {};
}

Result<void> check_description(const Description& d) {
  if (auto grid = check_grid(d.grid); !grid) return grid;
  if (!(d.range.alpha <= d.range.beta)) return fail("invalid range: alpha is greater than beta");
  if (auto format = check_value_format(d.format); !format) return format;
  if (std::any_of(d.corners.begin(), d.corners.end(), [&d](ValueKey key) { return key > d.format.last; }))
    return fail("a corner's value is out of range");
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  return {};
}

}  // namespace intervale
