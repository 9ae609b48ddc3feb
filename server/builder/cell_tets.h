// The tetrahedra of the mesh that is refined everywhere.
//
// They are those of the diamonds of class 0 and scale -1, six around one diagonal of each cell of samples. By the rule
// of Weiss and De Floriani 2008, section 5, the diagonal runs from the corner whose coordinates are all even to the one
// whose coordinates are all odd. Clamping to the box leaves them as they are or makes them flat: those of the cells
// inside the box are all that exist.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/diamond/diamond.h"

namespace intervale {

// Corners of the tetrahedra, each a sixth of the cell. Bit k of a corner: whether it is away, along axis k, from the
// corner with even coordinates.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kCellTets{
    {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};

// The cell whose corner nearest to (0, 0, 0) is given: its corners' places in an array of samples, x fastest, relative
// to that corner, numbered as in kCellTets. row, slice: the distances of neighbours on y and z.
[[nodiscard]] inline std::array<std::ptrdiff_t, 8> cell_corners(Vertex first, std::ptrdiff_t row, std::ptrdiff_t slice) {
  const int even = (first.x & 1) | (first.y & 1) << 1 | (first.z & 1) << 2;
  std::array<std::ptrdiff_t, 8> places{};
  for (int i = 0; i < 8; ++i) {
    const int at = i ^ even;
    places[i] = (at & 1) + (at >> 1 & 1) * row + (at >> 2) * slice;
  }
  return places;
}

}  // namespace intervale
