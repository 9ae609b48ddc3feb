// Makes the table of the volumes that ranges enclose (volume_table.h).
#pragma once

#include "common/ivm/volume_table.h"
#include "common/patch/volume.h"

namespace intervale {

// The positions (some tens to hundreds) are chosen by a sample of the tetrahedra; the sums are over all cells, in a
// volume of more than 2^19 samples over about 2^19 cells that lie evenly in it.
// volume: finite samples. O(n) for n samples, more where many positions lie within the values of one cell; 4 bytes for
// each sample of a slice across z, and thread. Uses all cores that oneTBB may. The table does not depend on the number
// of threads.
[[nodiscard]] VolumeTable make_volume_table(const Volume& volume);

}  // namespace intervale
