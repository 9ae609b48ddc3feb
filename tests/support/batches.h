// Batches of any updates one likes, as tests want them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front/batch_decoder.h"
#include "common/ivm/batch_encoder.h"

namespace intervale::testing {

// The batch of these updates, in any order; each once; for a client that has `before` already.
inline std::vector<std::uint8_t> batch_of(const IntervalVolume& volume, std::span<const UpdateIndex> updates,
                                          std::span<const UpdateIndex> before = {}) {
  SplitSet split(volume.set());
  for (UpdateIndex i : before) split.insert(volume.set().place(i));
  for (UpdateIndex i : updates) split.insert(volume.set().place(i));
  std::vector<UpdateIndex> sorted(updates.begin(), updates.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<SlotGroup> groups;
  for (UpdateIndex i : sorted) {
    const Place p = volume.set().place(i);
    if (groups.empty() || groups.back().supercube != p.supercube) groups.push_back({p.brick, p.supercube, p.key, 0});
    groups.back().slots |= std::uint64_t(1) << p.slot;
  }
  return encode_batch(volume, {volume.description().whole()}, split, groups);
}

// Applies a batch for the data set's own range.
inline Result<std::uint64_t> apply_to(Front& front, const Description& description, std::span<const std::uint8_t> batch,
                                      std::uint64_t max_tets = ~std::uint64_t(0)) {
  return apply_batch(std::span(&front, 1), description, {description.whole()}, batch, max_tets);
}

}  // namespace intervale::testing
