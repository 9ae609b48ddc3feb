#include "common/patch/description.h"

#include <cmath>

namespace intervale {

Result<void> check_description(const Description& d) {
  for (int i = 0; i < 3; ++i) {
    if (d.grid.dims[i] < kMinSide || d.grid.dims[i] > kMaxSide)
      return fail("a side of " + std::to_string(d.grid.dims[i]) + " samples is out of bounds");
    const double far = d.grid.origin[i] + d.grid.spacing[i] * (d.grid.dims[i] - 1);
    if (!(d.grid.spacing[i] > 0) || !std::isfinite(d.grid.origin[i]) || !std::isfinite(far)) return fail("spacing or origin is out of bounds");
  }
  if (!(d.range.alpha <= d.range.beta)) return fail("invalid range: alpha is greater than beta");
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  return {};
}

}  // namespace intervale
