// Batches of any updates one likes, as tests want them.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/update_codec.h"

namespace intervale::testing {

// The batch of these updates, in any order; each once.
inline std::vector<std::uint8_t> batch_of(const IntervalVolume& volume, std::span<const UpdateIndex> updates) {
  std::vector<UpdateIndex> sorted(updates.begin(), updates.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<BatchGroup> groups;
  for (UpdateIndex i : sorted) {
    const Place p = volume.set().place(i);
    if (groups.empty() || groups.back().supercube != p.supercube) groups.push_back({p.brick, p.supercube, p.key, 0});
    groups.back().slots |= std::uint64_t(1) << p.slot;
  }
  return encode_batch(volume, groups);
}

}  // namespace intervale::testing
