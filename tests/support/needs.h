// What is known of single updates and supercubes of what is relevant.
#pragma once

#include "common/ivm/interval_volume.h"
#include "common/ivm/value_bounds.h"
#include "common/util/bits.h"

namespace intervale::testing {

inline std::size_t number_in_brick(const IntervalVolume& v, BrickIndex b, SupercubeIndex s) { return s - v.set().bricks()[b].first_supercube; }

inline std::uint64_t slots_of(const RelevantUpdates& relevant, const IntervalVolume& v, BrickIndex b, SupercubeIndex s) {
  return relevant.brick(b).slots(number_in_brick(v, b, s), v.set().occupancy()[s]);
}

inline ErrorToDistance to_distance_of(const RelevantUpdates& relevant, const IntervalVolume& v, BrickIndex b, SupercubeIndex s) {
  return relevant.brick(b).to_distance(number_in_brick(v, b, s));
}

inline bool is_relevant(const RelevantUpdates& relevant, const IntervalVolume& v, const Place& p) {
  return (slots_of(relevant, v, p.brick, p.supercube) >> unsigned(p.slot) & 1U) != 0;
}

// Whether an update counts, by what the values around its diamond say: the definition.
inline bool counts_naively(const IntervalVolume& v, const ShownRange& shown, const Place& p) {
  const CountingKeys counts(KeySides(v.description().format, shown.range), shown.refine);
  const Diamond d(SupercubeSet::centre(p));
  KeySpan span{v.key(p.index), v.key(p.index)};
  for (int i = 0; i < int(d.row->vertices); ++i) {
    const int corner = v.domain().corner_number(d.vertex(i));
    const auto place = corner < 0 ? v.set().find(d.vertex(i)) : std::nullopt;
    if (corner >= 0) span.add(v.description().corners[std::size_t(corner)]);
    if (place) span.add(v.key(place->index));
  }
  return counts(span.least, span.greatest);
}
// Likewise, for the range of the data set.
inline bool counts_naively(const IntervalVolume& v, const Place& p) { return counts_naively(v, v.description().whole(), p); }

// Of an update; 0 if it is not relevant.
inline BrickNeeds::OfUpdate of_update(const RelevantUpdates& relevant, const IntervalVolume& v, const Place& p) {
  if (!is_relevant(relevant, v, p)) return {};
  return relevant.brick(p.brick).of_update(number_in_brick(v, p.brick, p.supercube), slots_of(relevant, v, p.brick, p.supercube), p.slot);
}
inline unsigned slope_of(const RelevantUpdates& relevant, const IntervalVolume& v, const Place& p) { return of_update(relevant, v, p).slope; }
inline std::uint8_t distance_of(const RelevantUpdates& relevant, const IntervalVolume& v, const Place& p) {
  return of_update(relevant, v, p).distance;
}
inline float object_error_of(const RelevantUpdates& relevant, const IntervalVolume& v, const Place& p) {
  return relevant.object_error(to_distance_of(relevant, v, p.brick, p.supercube), scale_of_key(p.key), v.error_step(p.index),
                               distance_of(relevant, v, p));
}

// Of all supercubes.
inline std::vector<ErrorToDistance> error_to_distance_of(const RelevantUpdates& relevant, const IntervalVolume& v) {
  std::vector<ErrorToDistance> codes;
  for (BrickIndex b{0}; b < v.set().bricks().size(); ++b) {
    v.set().for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) { codes.push_back(to_distance_of(relevant, v, b, s)); });
  }
  return codes;
}
inline std::vector<std::uint64_t> slots_of(const RelevantUpdates& relevant, const IntervalVolume& v) {
  std::vector<std::uint64_t> slots;
  for (BrickIndex b{0}; b < v.set().bricks().size(); ++b) {
    v.set().for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) { slots.push_back(slots_of(relevant, v, b, s)); });
  }
  return slots;
}

}  // namespace intervale::testing
