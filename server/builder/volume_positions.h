// Where a table of enclosed volumes needs positions (make_volume_table.h).
#pragma once

#include <cstddef>
#include <vector>

#include "common/patch/volume.h"

namespace intervale {

// A point of the distribution of F over the box: the shares of {F < value} and {F <= value}, 0 to 1.
struct DistributionPoint {
  double value = 0, below = 0, not_above = 0;
};

// Points of the distribution, ascending by value, between which it is linear up to a tolerance: from `not_above` of one
// to `below` of the next. Jumps larger than twice the tolerance lie at points. The first point is the least sample, the
// last one the greatest (the same if there is only one value).
//
// The distribution is estimated from F at `count` points of the box or up to twice as many, in as many tetrahedra or in
// all. least, greatest: of all samples. O(count log count); independent of the number of threads.
[[nodiscard]] std::vector<DistributionPoint> estimate_volumes(const Volume& volume, double least, double greatest, std::size_t count,
                                                              double tolerance);

}  // namespace intervale
