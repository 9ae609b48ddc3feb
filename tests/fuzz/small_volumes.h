// The volumes that fuzz targets and their seeds are made from.
#pragma once

#include <utility>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "server/builder/field_hierarchy.h"
#include "server/builder/value_builder.h"
#include "server/builder/value_steps.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/channels.h"

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
      if (i == 1) set_channels(made.back(), 1);
    }
    return made;
  }();
  return all;
}

// The values of the same boxes: floats in steps, and whole numbers.
inline const std::vector<ValueVolume>& small_value_volumes() {
  static const std::vector<ValueVolume> all = [] {
    std::vector<ValueVolume> made;
    for (const std::array<std::int32_t, 3>& dims : {std::array{5, 5, 5}, std::array{4, 7, 6}, std::array{2, 6, 3}}) {
      Volume volume = dims[0] == 5 ? gyroid(dims) : digits(dims, unsigned(dims[0]));
      const ValueFormat format = choose_value_format(volume, {}).value();
      ValueVolume::Parts parts = build_value_volume(volume, format).take();
      if (dims[0] == 2) {
        auto channel = build_channel(places(dims), "place", {}, parts.set).value();
        parts.description.channels.push_back(std::move(channel.channel));
        parts.channel_keys.push_back(std::move(channel.keys));
      }
      made.emplace_back(std::move(parts));
    }
    return made;
  }();
  return all;
}

}  // namespace intervale::testing
