// Builds the values of every range from a volume.
#pragma once

#include <functional>

#include "common/ivm/value_volume.h"
#include "common/patch/volume.h"
#include "server/builder/kept_errors.h"

namespace intervale {

// The values of a volume, as keys of `format`, with the errors of all diamonds. The samples, which are finite, are
// replaced by the values of their keys (value_steps.h). The description's name is the volume's.
// progress: called with the fraction done, 0 to 1, from any thread, one call at a time. kept: as of BuildOptions. Uses all
// cores that oneTBB may.
[[nodiscard]] ValueVolume build_value_volume(Volume& volume, const ValueFormat& format, const std::function<void(double)>& progress = {},
                                             KeptErrors* kept = nullptr);

}  // namespace intervale
