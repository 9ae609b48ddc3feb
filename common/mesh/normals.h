// Smooth normals of a surface of triangles: at each point the sum of the triangles' unit normals, weighted by their
// angles there.
//
// G. Thürmer and C. A. Wüthrich, Computing Vertex Normals from Polygonal Facets, Journal of Graphics Tools 3(1), 1998.
// Sums are whole numbers: they do not depend on the order of the triangles, and what a triangle added can be subtracted
// again exactly.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "common/util/vec3.h"

namespace intervale {

// In steps of 2^-20; only its direction matters.
using NormalSum = std::array<std::int32_t, 3>;

// What a triangle, counterclockwise seen from outside, adds at each of its corners; 0 if it has no area. Directions are
// those of the space of the corners: apply the grid's affine to samples first. arc_cosine: of a number that rounding
// may bring slightly beyond -1 or 1. Its precision is the caller's choice, since it takes much of the time.
template <class ArcCosine>
[[nodiscard]] std::array<NormalSum, 3> angle_weighted_normals(const std::array<Vec3, 3>& corners, const ArcCosine& arc_cosine) {
  constexpr double kSteps = 1 << 20;
  std::array<NormalSum, 3> added{};
  std::array<Vec3, 3> side;  // from corner k to the next
  std::array<double, 3> side_length;
  for (std::size_t k = 0; k < 3; ++k) {
    side[k] = subtract(corners[(k + 1) % 3], corners[k]);
    side_length[k] = std::sqrt(dot(side[k], side[k]));
  }
  const Vec3 normal = cross(side[0], side[1]);
  const double twice_area = std::sqrt(dot(normal, normal));
  if (!(twice_area > 0)) return added;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t before = (k + 2) % 3;
    const double angle = arc_cosine(-dot(side[k], side[before]) / (side_length[k] * side_length[before]));
    const double weight = angle * kSteps / twice_area;
    for (std::size_t i = 0; i < 3; ++i) added[k][i] = std::int32_t(std::lrint(weight * normal[i]));
  }
  return added;
}

}  // namespace intervale
