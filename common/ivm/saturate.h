// Saturated errors: those above any threshold belong to a set of diamonds that includes all their ancestors, which form
// a conforming mesh (Weiss and De Floriani 2008, section 3, after Gerstner and Pajarola).
#pragma once

#include <algorithm>
#include <bit>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/util/bits.h"
#include "common/util/parallel.h"

namespace intervale {

// Calls visit(diamond, child), numbers of updates, for each diamond of the scales 0 to scales - 1 and each of its children
// in the set: for all children of a diamond before it is a child itself. Diamonds of one class of a scale are visited on
// many threads, each on one.
template <class Visit>
void for_each_child(const SupercubeSet& set, int scales, const ParallelFor& parallel, const Visit& visit) {
  for (int scale = 0; scale < scales; ++scale) {
    const auto [begin, end] = set.of_scale(scale);
    for (int cls = scale > 0 ? 2 : 1; cls >= 0; --cls) {
      parallel(end - begin, [&, begin = begin](std::size_t piece) {
        const BrickIndex brick(begin + std::uint32_t(piece));
        SetNeighbours neighbours(set);
        set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
          const std::uint64_t slots = set.occupancy()[s] & kSlotsOfClass[std::size_t(cls)];
          if (slots == 0) return;
          neighbours.move_to(key);
          UpdateIndex next = set.first(brick, s) + std::popcount(set.occupancy()[s] & (slots - 1) & ~slots);
          for (const Slot slot : set_bits<Slot>(slots)) {
            const UpdateIndex diamond = next++;
            for (const Link link : neighbours.children(slot)) {
              const SetFinder::Found& found = neighbours.at(link.where);
              if (found.has(link.slot)) visit(diamond, found.index(link.slot));
            }
          }
        });
      });
    }
  }
}

// Raises the errors of the diamonds of scales 0 to scales - 1 to at least those of their children in the set. errors: by
// number.
template <class Error>
void saturate(const SupercubeSet& set, std::vector<Error>& errors, int scales, const ParallelFor& parallel) {
  for_each_child(set, scales, parallel, [&](UpdateIndex diamond, UpdateIndex child) { errors[diamond] = std::max(errors[diamond], errors[child]); });
}

}  // namespace intervale
