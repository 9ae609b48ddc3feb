// A set of updates in few bytes, for a session that rests: range coded, since what a client has follows the
// surfaces. 0.1 to 0.2 byte for each update of a view within some pixels, where a SplitSet takes 0.5 to 0.7.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/diamond/supercube.h"

namespace intervale {

// Immutable. Packing and unpacking take some 10 ns for each update of a supercube that has one in the set, and O(bricks).
class PackedSplits {
 public:
  PackedSplits() = default;  // an empty set
  PackedSplits(const SupercubeSet& set, const SplitSet& splits);
  // set: the same.
  [[nodiscard]] SplitSet unpack(const SupercubeSet& set) const;
  [[nodiscard]] std::size_t memory_bytes() const { return bytes_.capacity(); }

 private:
  std::vector<std::uint8_t> bytes_;  // empty: so is the set
};

}  // namespace intervale
