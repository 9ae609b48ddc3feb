// A diamond's parents in a set, each looked up by its centre: the naive model of the product's for_each_parent().
#pragma once

#include "common/diamond/supercube.h"

namespace intervale::testing {

// Calls visit(number) for those of a diamond's parents that are in the set.
template <class Visit>
void for_each_parent(const SupercubeSet& set, const Place& p, Visit&& visit) {
  const Diamond d(set.centre(p));
  for (int k = 0; k < d.row->parents; ++k) {
    const Vertex c = d.parent(k);
    if ((c.x | c.y | c.z) < 0) continue;
    if (const auto parent = set.find(c)) visit(parent->index);
  }
}

}  // namespace intervale::testing
