// Refining a mesh to a level of detail, without a server: from Sigma, or from any other source of the same updates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/front/front.h"
#include "common/ivm/interval_volume.h"
#include "common/ivm/refinement.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct Extraction {
  Front front;
  std::uint64_t updates = 0;  // shown
};

// The mesh of a level of detail within its budgets, for each of these ranges: most important updates first, never more
// than max_tets tetrahedra together or max_updates updates. relevant: to these ranges. Fails if check_lod fails, and on
// a volume whose updates contradict each other (validate() says which).
[[nodiscard]] Result<std::vector<Extraction>> extract(const IntervalVolume& volume, const RelevantUpdates& relevant, const ShownRanges& shown,
                                                      const Lod& lod, const ParallelFor& parallel = serial);
// The same, of one range.
[[nodiscard]] Result<Extraction> extract(const IntervalVolume& volume, const RelevantUpdates& relevant, const Lod& lod,
                                         const ParallelFor& parallel = serial);
// The same, for the range of the data set.
[[nodiscard]] inline Result<Extraction> extract(const IntervalVolume& volume, const Lod& lod, const ParallelFor& parallel = serial) {
  return extract(volume, volume.relevant(), lod, parallel);
}

// Channels of a data set, by number, for the meshes of what was extracted from it. volume: must outlive the result.
[[nodiscard]] std::vector<MeshChannel> channels_of(const IntervalVolume& volume, std::span<const std::size_t> numbers);

// The front of a data set before the first split.
[[nodiscard]] Front root_front(const Description& description, const ShownRange& shown);
[[nodiscard]] inline Front root_front(const Description& description) { return root_front(description, description.whole()); }

}  // namespace intervale
