// Which diamonds of a field a range and a level of detail need. Pure functions of the values and errors.
#pragma once

#include <vector>

#include "common/diamond/supercube.h"
#include "common/ivm/value_volume.h"
#include "common/patch/description.h"
#include "common/util/parallel.h"
#include "common/view/lod.h"

namespace intervale {

// What is wanted of a field.
struct RangeLod {
  Range range;  // alpha <= beta
  Refine refine = Refine::boundary;
  Lod lod;  // as check_lod accepts it; without a camera, and budgets are not considered here
};

// The diamonds that count for the range (front.h), with an error greater than that of the level of detail (any, if that
// is 0), in its region, and all their ancestors: keys strictly ascending. At scale 0 the error is that of the spine
// alone, for a larger one is a descendant's, and wanted with it; diamonds that the box cuts always have one.
[[nodiscard]] std::vector<SlotGroup> select(const ValueVolume& volume, const RangeLod& wanted, const ParallelFor& parallel = serial);

}  // namespace intervale
