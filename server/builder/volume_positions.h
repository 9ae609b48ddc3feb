// Where a table of enclosed volumes needs positions (make_volume_table.h).
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "common/diamond/diamond.h"
#include "server/builder/sample_view.h"

namespace intervale {

using CellFilter = std::function<bool(Vertex first)>;  // a cell, by its sample with the least coordinates; empty: all

// A point of the distribution of F over the box: the shares of {F < value} and {F <= value}, 0 to 1.
struct DistributionPoint {
  double value = 0, below = 0, not_above = 0;
};

// Points of the distribution, ascending by value, between which it is linear up to a tolerance: from `not_above` of one
// to `below` of the next. Jumps larger than twice the tolerance lie at points. The first point is the least sample, the
// last one the greatest (the same if there is only one value).
//
// values: those of values_in_cells(), of all cells, in any order. least, greatest: of all samples. O(count log count);
// independent of the number of threads.
[[nodiscard]] std::vector<DistributionPoint> estimate_volumes(std::vector<double> values, double least, double greatest, double tolerance);

// F at `count` points of the box or up to twice as many, in as many tetrahedra or in all; of these, the ones in cells that
// are wanted; the samples of other cells are not read.
[[nodiscard]] std::vector<double> values_in_cells(const SampleView& view, std::size_t count, const CellFilter& wanted = {});

}  // namespace intervale
