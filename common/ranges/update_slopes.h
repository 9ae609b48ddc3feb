// Which updates are worth their bytes: how much squared deviation of the surface each takes away.
//
// An update by itself says too little: some move the surface away, so that their children can bring it nearer than it
// was. So updates are joined in clusters, as trees are pruned to the lower convex hull of distortion over rate (Chou,
// Lookabaugh and Gray, Optimal pruning with applications to tree-structured source coding and modeling, 1989): fine to
// coarse, a diamond takes in its children's clusters as long as theirs remove more for each update than its own. A child
// has several parents; each gets an equal part of its cluster.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/util/parallel.h"

namespace intervale {

// By update, its slope (SurfaceErrors::slopes): of its cluster; kMaxSlope for diamonds coarser than top_scale. It may be
// higher than that of a parent. removed: by update, as in SurfaceDeviation; what is below 0 counts as 0. scales: of the
// domain. Throws what `parallel` throws.
[[nodiscard]] std::vector<std::uint8_t> update_slopes(const SupercubeSet& set, std::span<const double> removed, int scales, int top_scale,
                                                      const ParallelFor& parallel = serial);

}  // namespace intervale
