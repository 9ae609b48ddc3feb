#include "common/patch/description.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace intervale {

Result<void> check_grid(const Grid& grid) {
  for (int i = 0; i < 3; ++i) {
    if (grid.dims[i] < kMinSide || grid.dims[i] > kMaxSide) return fail("a side of " + std::to_string(grid.dims[i]) + " samples is out of bounds");
    const double far = grid.origin[i] + grid.spacing[i] * (grid.dims[i] - 1);
    if (!(grid.spacing[i] > 0) || !std::isfinite(grid.origin[i]) || !std::isfinite(far)) return fail("spacing or origin is out of bounds");
  }
  return {};
}

ShownRange resolve(const Description& d, const RangeRequest& request) {
  ShownRange shown = d.whole();
  if (request.range && (d.has_every_range || *request.range != d.range)) shown = {*request.range, Refine::boundary};
  if (request.refine) shown.refine = *request.refine;
  return shown;
}

Result<void> check_held(const Description& d, const ShownRange& shown) {
  const bool is_within = shown.range.alpha >= d.range.alpha && shown.range.beta <= d.range.beta;
  if (shown == d.whole() || (is_within && d.refine == Refine::uniform)) return {};
  std::ostringstream has;
  has << "[" << d.range.alpha << ", " << d.range.beta << "]";
  if (!is_within && d.refine == Refine::uniform) {
    return misuse("the data set '" + d.name + "' has the ranges within " + has.str() + ": build it without --range for every range");
  }
  if (shown.range != d.range) {
    return misuse("the data set '" + d.name + "' was built for the range " + has.str() + " alone: build it without --range for every range");
  }
  return misuse("the data set '" + d.name + "' was refined at its surfaces only: build it without --range, or with --refine uniform");
}

Result<void> check_description(const Description& d) {
  if (auto grid = check_grid(d.grid); !grid) return grid;
  if (!(d.range.alpha <= d.range.beta)) return fail("invalid range: alpha is greater than beta");
  const bool is_infinite = std::isinf(d.range.alpha) && std::isinf(d.range.beta);
  if (d.has_every_range && !(is_infinite && d.refine == Refine::uniform)) return fail("a data set of every range has another range");
  if (auto format = check_value_format(d.format); !format) return format;
  if (std::any_of(d.corners.begin(), d.corners.end(), [&d](ValueKey key) { return key > d.format.last; }))
    return fail("a corner's value is out of range");
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  return {};
}

}  // namespace intervale
