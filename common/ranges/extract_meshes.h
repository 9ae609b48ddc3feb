// From a data set to meshes of any ranges that it has, without a server.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/mesh/mesh.h"
#include "common/util/parallel.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct ExtractedMesh {
  Range range;
  Mesh mesh;
  std::uint64_t updates = 0;  // shown
};

// A mesh for each range, with these channels. shown: as check_held() accepts it. Fails as extract() does
// (extraction.h). Errors on the screen are exact. Throws what `parallel` throws.
[[nodiscard]] Result<std::vector<ExtractedMesh>> extract_meshes(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown,
                                                                const Lod& lod, std::span<const std::size_t> channels, const ParallelFor& parallel);

}  // namespace intervale
