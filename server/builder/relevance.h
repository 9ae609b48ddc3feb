// Which diamonds are relevant to a range (Weiss and De Floriani 2008, section 6).
//
// With Refine::uniform, as in the paper: those with a vertex or centre inside the range, or with some below and some
// above it, and their ancestors. With Refine::boundary (the criterion of the paper's section 8): those whose vertices
// and centre do not all lie on one side, and their ancestors.
//
// Sides take two bits a sample. At each scale, the sides at multiples of h and the results are rows of bits along x,
// and 64 diamonds of a row are judged at once: which vertices a diamond has depends only on which of its coordinates
// are odd, so all diamonds at even x of a row have the same vertices, and so do those at odd x.
#pragma once

#include <cstdint>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/patch/range.h"
#include "common/patch/volume.h"
#include "common/ranges/border_shape.h"

namespace intervale {

struct Relevance {
  SupercubeSet set;             // the relevant diamonds
  std::uint64_t unit_cuts = 0;  // cuts on all edges of the mesh that is refined everywhere
};

// Uses all cores that oneTBB may, and less than half a byte a sample, with rows rounded up to multiples of 64 samples.
// shapes: by scale. Throws std::length_error if relevant diamonds are in more than kMostSupercubes.
[[nodiscard]] Relevance find_relevant(const Volume& volume, const Range& range, Refine refine, const std::vector<BorderShapes>& shapes);

}  // namespace intervale
