// What a range needs of an interval volume that has it.
//
// A range has two surfaces, at its lower and its upper end, and what it needs is what each of them needs: a diamond is
// relevant if the values below it lie on both sides of one of them, and surfaces around it can move as far as the one
// that can move farther. So each surface is judged by itself, and a range that is dragged at one end keeps the other.
// Only refinement of the inside, too, is a matter of both.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ranges/restored_field.h"
#include "common/util/parallel.h"

namespace intervale {

// What RelevantUpdates::object_error() tells. Each tells more than those before.
enum class Distances {
  none,       // 0; levels of detail without a camera need no more
  estimated,  // estimate_surface.h: within a factor of 4 for most; by brick, some 15 ns for each relevant update
  measured,   // error_to_distance.h, for each update; one to two microseconds for each relevant update
};

// What is found of a range at once. Surfaces with the same values of keys on each side are one part, whichever end they
// are of; but where surfaces are measured at their own place (has_few_keys()), each place is another part.
struct RangePart {
  ShownRange shown;  // with one finite end, boundary; or refined inside, or without ends
  Distances distances = Distances::none;
  friend bool operator==(const RangePart&, const RangePart&) = default;
};

// One at least. distances: of the surfaces; parts that are refined inside have none.
[[nodiscard]] std::vector<RangePart> parts_of(const ValueFormat& format, const ShownRange& shown, Distances distances);

// Finds what parts need of one interval volume. One thread at a time.
class PartFinder {
 public:
  // The volume was refined uniformly and must outlive this, and what is found. What `parallel` throws, find() throws.
  explicit PartFinder(const IntervalVolume& volume, ParallelFor parallel = serial) : volume_(volume), parallel_(std::move(parallel)) {}

  // Measured distances are found at once; the first part with them restores the field, which is kept for the next ones: 1,
  // 2 or 8 bytes a sample. All else is found by brick, as it is asked for: that takes some microseconds here, except for
  // the first part of a volume, which may take O(updates) (IntervalVolume::bounds()).
  [[nodiscard]] std::shared_ptr<const RelevantUpdates> find(const RangePart& part);
  [[nodiscard]] const IntervalVolume& volume() const { return volume_; }

 private:
  [[nodiscard]] std::shared_ptr<const RelevantUpdates> find_measured(const RangePart& part);

  const IntervalVolume& volume_;
  ParallelFor parallel_;
  std::optional<RestoredField> field_;
};

using FindPart = std::function<std::shared_ptr<const RelevantUpdates>(const RangePart& part)>;

// Of parts that `find` finds. shown: one range at least, as check_held() accepts it for the volume. The data set's own
// range has measured distances in any case.
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume,
                                                                           const ShownRanges& shown, Distances distances, const FindPart& find);
[[nodiscard]] std::shared_ptr<const RelevantUpdates> find_relevant_updates(const std::shared_ptr<const IntervalVolume>& volume,
                                                                           const ShownRanges& shown, Distances distances,
                                                                           const ParallelFor& parallel = serial);

}  // namespace intervale
