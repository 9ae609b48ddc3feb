// Sets of splits of a field's hierarchy.
#pragma once

#include "common/diamond/split_set.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/parents.h"

namespace intervale::testing {

inline SplitSet all_of(const SupercubeSet& set) {
  SplitSet all(set);
  set.for_each_down([&all](const Place& p) { all.insert(p); });
  return all;
}

// Of the given splits, closed under parents, those that a front shows: those that count for the range, and their
// ancestors.
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
  SplitSet shown(delta.set());
  delta.set().for_each_up([&](const Place& p) {
    if (!splits.contains(p)) return;
    if (!shown.contains(p) && !counts(Diamond(SupercubeSet::centre(p)))) return;
    shown.insert(p);
    for_each_parent(delta.set(), p, [&](UpdateIndex parent) { shown.insert(delta.set().place(parent)); });
  });
  return shown;
}

}  // namespace intervale::testing
