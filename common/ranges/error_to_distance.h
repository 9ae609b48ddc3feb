// From errors to distances, by measuring how far surfaces move (FORMAT.md, "From errors to distances").
#pragma once

#include <functional>
#include <vector>

#include "common/diamond/domain.h"
#include "common/ivm/relevant_updates.h"
#include "common/patch/volume.h"
#include "common/util/parallel.h"

namespace intervale {

// Of the set, the relevant diamonds; with slopes, and if they are wanted with distances. Samples are finite. error: of an
// update, saturated; max_error: the largest of the data set. range: as of surface_deviation(). Throws what `parallel`
// throws.
[[nodiscard]] SurfaceErrors measure_error_to_distance(const Volume& volume, const Range& range, const Domain& domain, const SupercubeSet& set,
                                                      const std::function<double(UpdateIndex)>& error, double max_error, bool with_distances,
                                                      const ParallelFor& parallel);

}  // namespace intervale
