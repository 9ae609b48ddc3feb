// The volumes that fuzz targets and their seeds are made from.
#pragma once

#include <vector>

#include "common/ivm/interval_volume.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"

namespace intervale::testing {

// Three volumes: a cube that nothing clamps, a box that clamps on every axis, and a flat one whose range is a single
// value.
inline const std::vector<IntervalVolume>& small_volumes() {
  static const std::vector<IntervalVolume> all = [] {
    const std::vector<std::array<std::int32_t, 3>> dims{{5, 5, 5}, {4, 7, 6}, {2, 6, 3}};
    const std::vector<Range> ranges{{-0.3, 0.2}, {3, 5.5}, {4, 4}};
    std::vector<IntervalVolume> made;
    for (std::size_t i = 0; i < dims.size(); ++i) {
      const Volume volume = i == 0 ? gyroid(dims[i]) : digits(dims[i], unsigned(i));
      made.push_back(FieldHierarchy(volume, {.range = ranges[i]}).compact().value());
    }
    return made;
  }();
  return all;
}

}  // namespace intervale::testing
