// Makes the table of the volumes that ranges enclose (volume_table.h).
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/ivm/volume_table.h"
#include "common/patch/volume.h"
#include "server/builder/volume_positions.h"

namespace intervale {

// The positions (some tens to hundreds) are chosen by a sample of the tetrahedra; the sums are over all cells, in a
// volume of more than 2^19 samples over about 2^19 cells that lie evenly in it.
// volume: finite samples. O(n) for n samples, more where many positions lie within the values of one cell; 4 bytes for
// each sample of a slice across z, and thread. Uses all cores that oneTBB may. The table does not depend on the number
// of threads.
[[nodiscard]] VolumeTable make_volume_table(const Volume& volume);

// The same, of a volume that several programs share: each calls this with cells of its own, which together are all. All
// get the same table.
struct SampleShare {
  SampleView view;
  double least = 0, greatest = 0;  // of all samples
  CellFilter cells;                // the own ones
  // Replace what each program has by what all have: side by side, in any order; or their sums, element by element.
  std::function<void(std::vector<double>&)> join;
  std::function<void(std::span<std::uint64_t>)> sum;
};
[[nodiscard]] VolumeTable make_volume_table(const SampleShare& share);

}  // namespace intervale
