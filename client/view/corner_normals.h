// The sums of angle-weighted normals (common/mesh/normals.h) in single precision, of many triangles at once: loops over
// arrays, which compilers make vector instructions of.
//
// Sides are taken in samples. With A the linear part of the grid's affine, the cross product of two sides in the world
// is that in samples times A's cofactors, and their dot product is that with A^T A between them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/diamond/affine.h"

namespace intervale {

inline constexpr std::size_t kLanes = 32;  // triangles or normals at once

template <class T>
using Lanes = std::array<T, kLanes>;
template <class T>
using VectorLanes = std::array<Lanes<T>, 3>;  // x, y, z

class CornerNormals {
 public:
  // Spacings of which one is above 1e9 times another may be too much for single precision: their normals can be 0.
  explicit CornerNormals(const Affine& affine);

  // Of triangles that are counterclockwise in the world, the sides from corner 0 to corner 1 and to corner 2. In samples
  // or parts of them, at most 2^24.
  struct Sides {
    VectorLanes<float> first{}, second{};
  };
  // What they add at corners 0, 1 and 2: a NormalSum each. The same for the same sides, whichever lane they have. 0 for
  // a triangle without area.
  using Sums = std::array<VectorLanes<std::int32_t>, 3>;
  void sum(const Sides& sides, Sums& sums) const;

 private:
  std::array<float, 9> cofactors_;  // row by row
  std::array<float, 6> metric_;     // A^T A, which is symmetric: xx, xy, xz, yy, yz, zz
};

// Vectors made 127 long and rounded; 0 stays 0.
void make_unit_normals(const VectorLanes<float>& vectors, VectorLanes<std::int8_t>& normals);

}  // namespace intervale
