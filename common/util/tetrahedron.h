// The faces of a tetrahedron.
#pragma once

#include <array>
#include <cstdint>

namespace intervale {

// The corners of each face, counterclockwise seen from outside of a positive tetrahedron: (p1 - p0) x (p2 - p0) . (p3
// - p0) > 0. Face f lies opposite corner f.
inline constexpr std::array<std::array<std::uint8_t, 3>, 4> kTetFaces{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

}  // namespace intervale
