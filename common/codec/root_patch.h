// The root patch: the coarse mesh that every stream starts from (paper, section 6).
//
// As bytes: the sides of the root's 8 vertices in local order (0 below, 1 inside, 2 above), then the cuts of those of
// its 19 edges that belong to a tetrahedron which is not flat, in local order (edge_ends gives each edge's direction),
// alpha before beta.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/domain.h"
#include "common/patch/range.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr int kRootVertices = 8, kRootEdges = 19;

struct RootPatch {
  std::array<Side, kRootVertices> side{};
  std::array<Cuts, kRootEdges> cuts{};
};

[[nodiscard]] std::vector<std::uint8_t> encode_root_patch(const RootPatch& root_patch);

// The inverse, for bytes from outside: fails unless they are exactly one root patch of this domain.
[[nodiscard]] Result<RootPatch> decode_root_patch(std::span<const std::uint8_t> bytes, const Domain& domain);

}  // namespace intervale
