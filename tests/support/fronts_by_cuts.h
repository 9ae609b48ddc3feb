// Fronts that are split by the cuts of a field's hierarchy: what fronts that are split by values are compared with.
#pragma once

#include <gtest/gtest.h>

#include "common/diamond/split_set.h"
#include "common/front/front.h"
#include "server/builder/field_hierarchy.h"

namespace intervale::testing {

inline void split_by_cuts(Front& front, Front::Handle handle, const FieldHierarchy& delta, Vertex centre) {
  const Diamond d(centre);
  ASSERT_EQ(delta.context(d).cut, front.context(handle).cut) << "the field and the front know the same of a diamond";
  front.split(handle, delta.side(centre), delta.cuts(d));
}

inline SplitSet all_of(const SupercubeSet& set) {
  SplitSet all(set.size());
  for (UpdateIndex i{0}; i < set.size(); ++i) all.insert(i);
  return all;
}

// The front after the given splits, which must be closed under parents.
inline Front front_by_cuts(const FieldHierarchy& delta, const Grid& grid, const SplitSet& splits) {
  Front front(grid, delta.root_patch());
  delta.set().for_each_down([&](const Place& p) {
    if (!splits.contains(p.index)) return;
    const Vertex centre = SupercubeSet::centre(p);
    const auto handle = front.find(centre);
    ASSERT_TRUE(handle) << "the splits are not closed under parents";
    split_by_cuts(front, *handle, delta, centre);
  });
  return front;
}

// Of the given splits, closed under parents, those that a front split by values shows: those that count for the range,
// and their ancestors.
inline SplitSet shown_of(const FieldHierarchy& delta, Refine refine, const SplitSet& splits) {
  const auto counts = [&](const Diamond& d) {
    unsigned sides = 1u << unsigned(delta.side(d.centre));
    const unsigned exist = Domain::vertices(*d.row, delta.domain().tets(d));
    for (int v = 0; v < d.row->vertices; ++v) {
      if (exist >> v & 1) sides |= 1u << unsigned(delta.side(d.vertex(v)));
    }
    const bool is_inside = sides == 1u << unsigned(Side::inside);
    return (sides & (sides - 1)) != 0 || (refine == Refine::uniform && is_inside);
  };
  SplitSet shown(delta.set().size());
  delta.set().for_each_up([&](const Place& p) {
    if (!splits.contains(p.index)) return;
    if (!shown.contains(p.index) && !counts(Diamond(SupercubeSet::centre(p)))) return;
    shown.insert(p.index);
    for_each_parent(delta.set(), p, [&](UpdateIndex parent) { shown.insert(parent); });
  });
  return shown;
}

}  // namespace intervale::testing
