#include "client/view/corner_normals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/mesh/normals.h"
#include "common/util/vec3.h"

namespace intervale {
namespace {

// 1 / of, or 0 for 0.
float inverse_or_0(float of) { return of > 0 ? 1 / of : 0; }

}  // namespace

CornerNormals::CornerNormals(const Affine& affine) {
  // Lengths do not matter, so columns are divided by the longest one.
  const Vec3 spacing = affine.spacing();
  const double unit = 1 / std::max({spacing[0], spacing[1], spacing[2]});
  const std::array<Vec3, 3> column{scaled(unit, affine.column(0)), scaled(unit, affine.column(1)), scaled(unit, affine.column(2))};
  const std::array<Vec3, 3> cofactor_column{cross(column[1], column[2]), cross(column[2], column[0]), cross(column[0], column[1])};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) cofactors_[3 * i + j] = float(cofactor_column[j][i]);
  std::size_t n = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) metric_[n++] = float(dot(column[i], column[j]));
}

void CornerNormals::sum(const Sides& sides, Sums& sums) const {
  constexpr float kPi = std::numbers::pi_v<float>;
  const std::array<float, 9> c = cofactors_;
  const std::array<float, 6> m = metric_;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float ux = sides.first[0][i], uy = sides.first[1][i], uz = sides.first[2][i];
    const float vx = sides.second[0][i], vy = sides.second[1][i], vz = sides.second[2][i];
    const float x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    const std::array<float, 3> normal{c[0] * x + c[1] * y + c[2] * z, c[3] * x + c[4] * y + c[5] * z, c[6] * x + c[7] * y + c[8] * z};
    const float twice_area = std::sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
    const float mx = m[0] * ux + m[1] * uy + m[2] * uz, my = m[1] * ux + m[3] * uy + m[4] * uz, mz = m[2] * ux + m[4] * uy + m[5] * uz;
    const float at_0 = mx * vx + my * vy + mz * vz, at_1 = mx * (ux - vx) + my * (uy - vy) + mz * (uz - vz);
    const float a = quick_arc_tangent(twice_area, at_0), b = quick_arc_tangent(twice_area, at_1);
    const std::array<float, 3> angle{a, b, kPi - a - b};
    const float steps = float(kNormalSteps) * inverse_or_0(twice_area);
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t axis = 0; axis < 3; ++axis) sums[k][axis][i] = std::int32_t(std::nearbyint(angle[k] * (steps * normal[axis])));
    }
  }
}

void make_unit_normals(const VectorLanes<float>& vectors, VectorLanes<std::int8_t>& normals) {
  for (std::size_t i = 0; i < kLanes; ++i) {
    const float x = vectors[0][i], y = vectors[1][i], z = vectors[2][i];
    const float scale = 127 * inverse_or_0(std::sqrt(x * x + y * y + z * z));
    normals[0][i] = std::int8_t(std::int32_t(std::nearbyint(scale * x)));
    normals[1][i] = std::int8_t(std::int32_t(std::nearbyint(scale * y)));
    normals[2][i] = std::int8_t(std::int32_t(std::nearbyint(scale * z)));
  }
}

}  // namespace intervale
