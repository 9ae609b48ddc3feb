// What pages of values (value_page.h) are made from: parts of a data set of one range or of every range.
#pragma once

#include <array>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/value_keys.h"
#include "common/ivm/value_volume.h"
#include "common/patch/channel.h"
#include "common/patch/value_format.h"
#include "common/patch/value_weights.h"

namespace intervale {

// References to values to be read. All must outlive it.
struct PagedValues {
  // NOLINTBEGIN(google-explicit-constructor): the same thing, seen without what pages do not need
  PagedValues(const ValueVolume::Parts& p) : PagedValues(p.description, p.weights, p.set, p.keys, &p.error_levels) {}
  PagedValues(const IntervalVolume::Parts& p) : PagedValues(p.description, p.description.weights, p.set, p.keys, nullptr) {}
  PagedValues(const IntervalVolume& v) : PagedValues(v.description(), v.description().weights, v.set(), v.keys(), nullptr) {}
  // NOLINTEND(google-explicit-constructor)
  // Of a channel. keys: one for each of the set.
  PagedValues(const Grid& g, const SupercubeSet& s, const ChannelComponent& c, const ValueKeys& k)
      : set(s), keys(k), grid(g), format(c.format), corners(c.corners), weights(c.weights), max_error(0), error_levels(nullptr) {}

  const SupercubeSet& set;  // with each diamond all its ancestors
  const ValueKeys& keys;    // by number
  const Grid& grid;
  const ValueFormat& format;
  const std::array<ValueKey, kRootVertices>& corners;
  const ValueWeights& weights;
  double max_error;
  const std::vector<ErrorLevel>* error_levels;  // by number, as in ValueVolume::Parts; null: the pages hold values only

 private:
  template <class D>
  PagedValues(const D& d, const ValueWeights& w, const SupercubeSet& s, const ValueKeys& k, const std::vector<ErrorLevel>* levels)
      : set(s), keys(k), grid(d.grid), format(d.format), corners(d.corners), weights(w), max_error(d.max_error), error_levels(levels) {}
};

// References to values to be decoded: keys and error levels have their sizes, and are set.
struct DecodedValues {
  // NOLINTBEGIN(google-explicit-constructor)
  DecodedValues(ValueVolume::Parts& p) : values(p), keys(p.keys), error_levels(&p.error_levels) {}
  DecodedValues(IntervalVolume::Parts& p) : values(p), keys(p.keys), error_levels(nullptr) {}
  // NOLINTEND(google-explicit-constructor)
  DecodedValues(const Grid& g, const SupercubeSet& s, const ChannelComponent& c, ValueKeys& k) : values(g, s, c, k), keys(k), error_levels(nullptr) {}

  PagedValues values;
  ValueKeys& keys;                        // those of `values`
  std::vector<ErrorLevel>* error_levels;  // those of `values`
};

}  // namespace intervale
