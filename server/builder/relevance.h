// Which diamonds are relevant to a range: those that count (see Refine), and those with a relevant child.
//
// Sides are two bits a sample. At each scale those at multiples of h, and the answers, are kept as rows of bits along x, and 64 diamonds of a row are
// judged at once: which vertices a diamond has depends only on which of its coordinates are odd, so a row's even places are alike, and so are its odd
// ones. No diamond is looked at by itself, and where nothing happens little is spent.
#pragma once

#include <cstdint>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/patch/range.h"
#include "server/builder/outline.h"
#include "server/volume/volume.h"

namespace intervale {

struct Relevance {
  SupercubeSet set;             // the relevant diamonds
  std::uint64_t unit_cuts = 0;  // cuts on all edges of the mesh that is refined everywhere
};

// Uses all cores that oneTBB may, and less than half a byte a sample, rows counting as multiples of 64 samples. outlines: by scale.
[[nodiscard]] Relevance find_relevant(const Volume& volume, const Range& range, Refine refine, const std::vector<Outlines>& outlines);

}  // namespace intervale
