// How often the values of a field occur.
#pragma once

#include "common/ivm/value_volume.h"
#include "common/patch/volume.h"

namespace intervale {

// The histogram of the values that a format gives to samples.
//
// All bins stand for equally many keys, as few as kMostBins bins allow: if some stood for one key more than others,
// they would stick out. So a field of up to kMostBins keys has a bin for each, of the width of a step. In a format
// whose step is 0, keys are not equally far apart: there kMostBins bins divide [least, greatest] into equal parts. A
// constant field has one bin: of the width of a step, or of 1.
//
// format: chosen for this volume. O(n) for n samples; uses all cores that oneTBB may, and does not depend on their
// number.
[[nodiscard]] ValueHistogram make_value_histogram(const Volume& volume, const ValueFormat& format);

}  // namespace intervale
