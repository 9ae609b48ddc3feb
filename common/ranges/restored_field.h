// The field of an interval volume at the samples that it was built from.
#pragma once

#include "common/ivm/interval_volume.h"
#include "common/patch/volume.h"
#include "common/util/parallel.h"

namespace intervale {

// Immutable.
class RestoredField {
 public:
  // The volume was refined uniformly. About 10 ns a sample. Throws what `parallel` throws.
  RestoredField(const IntervalVolume& from, const ParallelFor& parallel);

  // Samples that the volume lacks are 0. In keys if these are of one or two bytes and each key is a step; otherwise f64.
  // Distances are the same in any unit.
  [[nodiscard]] const Volume& samples() const { return samples_; }

  // Where to measure the surface of a range with one finite end, in the unit of the samples. With few keys, nearly
  // at both values between which the range's own surface lies, alpha the greater; otherwise at the end of the range.
  [[nodiscard]] Range surface_of(const Range& range) const;

 private:
  ValueFormat format_;
  bool is_in_keys_;
  Volume samples_;
};

// Whether surfaces between the values of two neighbouring keys are measured as one: 1024 keys at most. Of more keys few
// would be shared.
[[nodiscard]] inline bool has_few_keys(const ValueFormat& format) { return format.last < 1024; }

}  // namespace intervale
