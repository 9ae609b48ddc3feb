// What a range needs of an interval volume that has it.
//
// A range has two surfaces, at its lower and its upper end, and what it needs is what each of them needs: a diamond is
// relevant if the values below it lie on both sides of one of them, and surfaces around it can move as far as the one
// that can move farther. So each surface is judged by itself, and a range that is dragged at one end keeps the other.
// Only refinement of the inside, too, is a matter of both.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "common/ivm/interval_volume.h"

namespace intervale {

// What RelevantUpdates::object_error() tells.
enum class Distances {
  none,       // 0; levels of detail without a camera need no more
  estimated,  // estimate_distances.h: within a factor of 4 for most; some 15 ns for each relevant update
  measured,   // error_to_distance.h; about a microsecond for each relevant update, and some 8 bytes a sample meanwhile
};

// The ranges that a range consists of, one at least: those with one surface; and itself, if its inside is refined.
[[nodiscard]] std::vector<ShownRange> parts_of(const ShownRange& shown);

// The range whose ends are values of keys, with the same values of keys inside. So it has the same needs, but for how
// far surfaces move, which depends on where they are between the values.
[[nodiscard]] ShownRange between_keys(const ValueFormat& format, const ShownRange& shown);

// What such a part needs. Refined inside: without distances. Uses all cores that oneTBB may.
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_part(const IntervalVolume& volume, const ShownRange& part, Distances distances);

// shown: one range at least, as check_held() accepts it for the volume.
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume,
                                                                           const ShownRanges& shown, Distances distances);

}  // namespace intervale
