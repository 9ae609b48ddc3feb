#include "common/ranges/extract_meshes.h"

#include "common/ivm/extraction.h"
#include "common/ranges/find_relevant_updates.h"

namespace intervale {

Result<std::vector<ExtractedMesh>> extract_meshes(const std::shared_ptr<const IntervalVolume>& volume, const ShownRanges& shown, const Lod& lod,
                                                  std::span<const std::size_t> channels, const ParallelFor& parallel) {
  const auto relevant = find_relevant_updates(volume, shown, lod.camera ? Distances::measured : Distances::none, parallel);
  const auto fronts = extract(*volume, *relevant, shown, lod, parallel);
  if (!fronts) return tl::unexpected(fronts.error());
  const std::vector<MeshChannel> values = channels_of(*volume, channels);
  std::vector<ExtractedMesh> meshes;
  for (const Extraction& one : *fronts) meshes.push_back({one.front.range(), one.front.mesh(parallel, values), one.updates});
  return meshes;
}

}  // namespace intervale
