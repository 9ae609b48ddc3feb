// The errors of all diamonds, measured by ranks that have some of the samples each.
//
// An error is the largest difference over the samples in a diamond, so ranks can look at samples of their own, and the
// largest of what they find is the error. A rank measures
//   - diamonds of scale 0 in blocks whose samples are its own;
//   - diamonds of scales 1 to 3 whose centres lie in its boxes: the samples around those reach as far as they do;
//   - of coarser ones, which are large, what lies in its boxes.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/patch/sample_type.h"
#include "server/builder/kept_errors.h"
#include "server/cluster/ranks.h"
#include "server/cluster/shares.h"

namespace intervale {

struct RankField {
  const Domain& domain;
  const Shares& shares;
  const SupercubeSet& coarse;  // all diamonds of scale 1 and coarser
  SampleType type = SampleType::u8;
  std::span<const std::byte> samples;  // of the cells known to this rank, and at the vertices of diamonds of scale 4 and coarser
};

struct RankErrors {
  std::vector<float> coarse;  // of `coarse`, by number, saturated over all children
  float greatest = 0;         // of all diamonds
};

// The same for all ranks. progress: as of BuildOptions, of this rank's part. kept: as of BuildOptions, under scale 0; used if
// all ranks have kept them. Uses all cores that oneTBB may.
[[nodiscard]] RankErrors measure_errors(Ranks& ranks, const RankField& field, const std::function<void(double)>& progress, KeptErrors* kept);

}  // namespace intervale
