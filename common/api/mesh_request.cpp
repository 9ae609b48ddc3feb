#include "common/api/mesh_request.h"

namespace intervale {

Result<void> check_request(const MeshRequest& request) {
  if (request.shown.ranges.size() > kMaxRanges) return misuse("at most " + std::to_string(kMaxRanges) + " ranges can be shown at once");
  for (const Range& range : request.shown.ranges) {
    if (!(range.alpha <= range.beta)) return misuse("a range needs LO <= HI, both numbers or infinite");
  }
  return check_lod(request.lod);
}

}  // namespace intervale
