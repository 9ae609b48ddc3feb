#include "common/patch/description.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <tuple>

#include "common/util/printable.h"

namespace intervale {

Result<void> check_grid(const Grid& grid) {
  const auto& rows = grid.affine.rows;
  for (const std::int32_t side : grid.dims) {
    if (side < kMinSide || side > kMaxSide) return fail("a side of " + std::to_string(side) + " samples is out of bounds");
  }
  if (!std::all_of(rows.begin(), rows.end(), [](double number) { return std::isfinite(number); }))
    return fail("spacing, origin or affine has a number that is not finite");
  const Vec3 far{double(grid.dims[0] - 1), double(grid.dims[1] - 1), double(grid.dims[2] - 1)};
  for (std::size_t i = 0; i < 3; ++i) {
    double low = 0, high = 0;  // of the corners, from the first sample
    for (std::size_t j = 0; j < 3; ++j) (rows[4 * i + j] < 0 ? low : high) += rows[4 * i + j] * far[j];
    if (!std::isfinite(high - low) || !std::isfinite(rows[4 * i + 3] + low) || !std::isfinite(rows[4 * i + 3] + high))
      return fail("the volume's far corner is beyond what a double holds; use a smaller spacing");
  }
  constexpr double kSingular = 1e-12;
  if (!(std::abs(grid.affine.relative_determinant()) > kSingular)) return fail("the affine is singular: it puts all samples into one plane");
  return {};
}

ShownRange resolve(const Description& d, const std::optional<Range>& range, const std::optional<Refine>& refine) {
  ShownRange shown = d.whole();
  if (range && (d.has_every_range || *range != d.range)) shown = {*range, Refine::boundary};
  if (refine) shown.refine = *refine;
  return shown;
}

ShownRanges resolve(const Description& d, const RangeRequest& request) {
  if (request.ranges.empty()) return {resolve(d, std::nullopt, request.refine)};
  ShownRanges shown;
  shown.reserve(request.ranges.size());
  for (const Range& range : request.ranges) shown.push_back(resolve(d, range, request.refine));
  return shown;
}

Result<void> check_held(const Description& d, const ShownRange& shown) {
  const bool is_within = shown.range.alpha >= d.range.alpha && shown.range.beta <= d.range.beta;
  if (shown == d.whole() || (is_within && d.refine == Refine::uniform)) return {};
  std::ostringstream has;
  has << "[" << d.range.alpha << ", " << d.range.beta << "]";
  if (!is_within && d.refine == Refine::uniform) {
    return misuse("the data set '" + printable(d.name) + "' has the ranges within " + has.str() + ": build it without --range for every range");
  }
  if (shown.range != d.range) {
    return misuse("the data set '" + printable(d.name) + "' was built for the range " + has.str() +
                  " alone: build it without --range for every range");
  }
  return misuse("the data set '" + printable(d.name) + "' was refined at its surfaces only: build it without --range, or with --refine uniform");
}

Result<void> check_held(const Description& d, const ShownRanges& shown) {
  if (shown.size() > kMaxRanges)
    return misuse("at most " + std::to_string(kMaxRanges) + " ranges can be shown at once, not " + std::to_string(shown.size()));
  for (const ShownRange& one : shown) {
    if (auto held = check_held(d, one); !held) return held;
  }
  return {};
}

Range range_around(const ShownRanges& shown) {
  Range all = shown.front().range;
  for (const ShownRange& one : shown) all = {std::min(all.alpha, one.range.alpha), std::max(all.beta, one.range.beta)};
  return all;
}

ShownRanges distinct(ShownRanges shown) {
  const auto bounds = [](const ShownRange& s) { return std::make_tuple(s.range.alpha, s.range.beta, s.refine); };
  std::sort(shown.begin(), shown.end(), [&bounds](const ShownRange& a, const ShownRange& b) { return bounds(a) < bounds(b); });
  shown.erase(std::unique(shown.begin(), shown.end()), shown.end());
  return shown;
}

Result<void> check_description(const Description& d) {
  if (auto grid = check_grid(d.grid); !grid) return grid;
  if (auto labels = check_labels(d.labels); !labels) return labels;
  if (!(d.range.alpha <= d.range.beta)) return fail("invalid range: alpha is greater than beta");
  const bool is_infinite = std::isinf(d.range.alpha) && std::isinf(d.range.beta);
  if (d.has_every_range && !(is_infinite && d.refine == Refine::uniform)) return fail("a data set of every range has another range");
  if (auto format = check_value_format(d.format); !format) return format;
  if (std::any_of(d.corners.begin(), d.corners.end(), [&d](ValueKey key) { return key > d.format.last; }))
    return fail("a corner's value is out of range");
  if (!(d.max_error >= 0) || !std::isfinite(d.max_error)) return fail("the largest error is negative or not finite");
  return check_channels(d.channels);
}

}  // namespace intervale
