// Which mesh of a data set is asked for.
#pragma once

#include <string>
#include <vector>

#include "common/patch/shown_range.h"
#include "common/util/export.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct MeshRequest {
  // The ranges of values, at most kMaxRanges: a data set of every range needs one at least, one of one range none. With
  // several, Mesh::part tells which range a tetrahedron is of.
  RangeRequest shown = {};
  Lod lod = {};                            // how fine, where, and how much at most; as check_lod() accepts it
  std::vector<std::string> channels = {};  // of the data set, which become Mesh::channels in the data set's order
};

// Misuse if it is valid for no data set: ranges without LO <= HI or too many of them, or what check_lod() refuses.
[[nodiscard]] INTERVALE_EXPORT Result<void> check_request(const MeshRequest& request);

}  // namespace intervale
