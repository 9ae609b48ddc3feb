// Chooses the whole numbers that represent a field's values, and converts samples to them.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <type_traits>
#include <vector>

#include "common/patch/value_format.h"
#include "common/patch/volume.h"
#include "common/util/result.h"
#include "server/builder/sample_range.h"

namespace intervale {

// All functions here use all cores that oneTBB may; their results do not depend on the number of threads.

// The format of a volume's samples, which are finite; at least one. O(n) for n samples.
//
// Whole numbers are exact, with step 1; `step` may be left out, 0 or 1. If they span all 2^32 values of their type: with
// a table of their values.
// Floats without `step`: exact if there is a step of which at most 2^16 values, and no more between the least and the
// greatest one, are whole multiples (exact_step.h). If not, a power of two: the greatest one that divides the distance
// of the least and the greatest sample into at least 2^11 steps, or the distance of neighbouring numbers of the type
// around the largest sample, whichever is greater.
// Floats with a step greater than 0: the nearest multiples of the step.
// Floats with step 0: exact. As without `step` if that is exact; otherwise f32 in the type's own numbers (step 0 of the
// format), and f64 in a step of up to 2^32 - 1 values, or with a table of the values.
// O(n log n), and 8 bytes for each sample, for f64 with step 0 and where whole numbers need a table.
//
// Where a format is not exact, a value differs from its sample by at most half a step, and the rounding of the type. A
// multiple that is too large for the type is replaced by the next one that is not.
//
// Misuse: a step that is negative or not finite; for whole numbers another one than 0 and 1; a step so fine that the
// samples span more than 2^32 of it, lie more than 2^53 of it from 0, or have a type that does not distinguish its
// multiples. Fails if a table would need more than 2^32 - 1 values.
[[nodiscard]] Result<ValueFormat> choose_value_format(const Volume& volume, std::optional<double> step);

// What the choice asks of samples that are not all in one place.
struct SampleSummary {
  SampleRange range;
  std::function<std::vector<double>()> few;  // the distinct ones of floats, ascending; none if they are more than kMostExact
  std::function<std::vector<double>()> all;  // the distinct ones, ascending
};
inline constexpr std::size_t kMostExact = std::size_t(1) << 16;  // values of an exact format that is chosen unasked
[[nodiscard]] Result<ValueFormat> choose_value_format(SampleType type, const SampleSummary& samples, std::optional<double> step);
// SampleSummary::few and all of a volume.
[[nodiscard]] std::vector<double> few_distinct_samples(const Volume& volume);
[[nodiscard]] std::vector<double> all_distinct_samples(const Volume& volume);

// The key of a sample. format: chosen for its volume.
template <class T>
[[nodiscard]] ValueKey key_of_sample(const ValueFormat& format, T sample) {
  if constexpr (std::is_integral_v<T>) {
    if (!format.table) return ValueKey(sample) - ValueKey(format.first);  // modulo 2^32
  }
  return format.key(double(sample));
}

// The key of each sample, in the order of the samples. format: chosen for this volume. O(n).
[[nodiscard]] std::vector<ValueKey> keys_of(const Volume& volume, const ValueFormat& format);

// Replaces each sample by the value of its key, so that whatever is computed from the volume holds for what the keys
// represent. Whole numbers are left as they are: their formats are exact. format: chosen for this volume. O(n).
void round_samples(Volume& volume, const ValueFormat& format);

}  // namespace intervale
