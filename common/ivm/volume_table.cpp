#include "common/ivm/volume_table.h"

#include <algorithm>
#include <cstddef>

namespace intervale {
namespace {

// The share at v, between the first and the last position and at none of them.
double between(const VolumeTable& table, double v) {
  const auto next = std::size_t(std::upper_bound(table.position.begin(), table.position.end(), v) - table.position.begin());
  const double from = table.position[next - 1], to = table.position[next];
  const double along = (v / 2 - from / 2) / (to / 2 - from / 2);  // halved: the difference of two doubles can overflow
  return table.not_above[next - 1] + along * (table.below[next] - table.not_above[next - 1]);
}

double share_at(const VolumeTable& table, const std::vector<double>& at_position, double v) {
  if (v < table.position.front()) return 0;
  if (v > table.position.back()) return 1;
  const auto found = std::lower_bound(table.position.begin(), table.position.end(), v);
  return *found == v ? at_position[std::size_t(found - table.position.begin())] : between(table, v);
}

}  // namespace

double VolumeTable::share_below(double v) const { return share_at(*this, below, v); }
double VolumeTable::share_not_above(double v) const { return share_at(*this, not_above, v); }
double VolumeTable::share_of(const Range& range) const { return std::max(0.0, share_not_above(range.beta) - share_below(range.alpha)); }

}  // namespace intervale
