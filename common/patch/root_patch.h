// The root patch: the coarse mesh that every stream starts from (paper, section 6).
#pragma once

#include <array>

#include "common/diamond/diamond.h"
#include "common/patch/range.h"

namespace intervale {

inline constexpr int kRootEdges = 19;

// The sides of the root's vertices, and the cuts on its edges, in local order (edge_ends gives each edge's direction).
struct RootPatch {
  std::array<Side, kRootVertices> side{};
  std::array<Cuts, kRootEdges> cuts{};
};

}  // namespace intervale
