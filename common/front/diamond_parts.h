// What the box leaves of a diamond, and the tetrahedra of its patch.
#pragma once

#include <cstdint>

#include "common/diamond/diamond.h"
#include "common/diamond/domain.h"

namespace intervale {

// What exists of a diamond: a bit each, by local number.
struct DiamondParts {
  std::uint32_t tets = 0, vertices = 0, edges = 0;
  bool straddles = false;  // clamping moves some vertices of those tetrahedra
};
[[nodiscard]] inline DiamondParts all_parts(const DiamondType& row) {
  return {(1u << row.tets) - 1, (1u << row.vertices) - 1, (1u << row.edges) - 1, false};
}
[[nodiscard]] DiamondParts parts_of(const Domain& domain, const Diamond& d);

// Whether half a tetrahedron, with the spine's end `end` and the centre for the other one, is not flat.
[[nodiscard]] bool half_exists(const Domain& domain, const Diamond& d, int tet, int end);

// The shape of a tetrahedron or of a half that exists.
[[nodiscard]] TetShape tet_shape(const Domain& domain, const Diamond& d, const DiamondParts& parts, int tet);
[[nodiscard]] TetShape half_shape(const Domain& domain, const Diamond& d, const DiamondParts& parts, int tet, int end);

// How many tetrahedra the patches of the diamond's tetrahedra have, and those of their halves. sides: two bits for each
// local vertex; of halves, also for the centre.
[[nodiscard]] std::uint64_t count_tets(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides);
[[nodiscard]] std::uint64_t count_halves(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides);
// The second less the first.
[[nodiscard]] std::int64_t count_added(const Domain& domain, const Diamond& d, const DiamondParts& parts, std::uint32_t sides);

}  // namespace intervale
