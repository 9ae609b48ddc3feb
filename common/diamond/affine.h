// The affine map from samples to the world.
#pragma once

#include <array>
#include <cstddef>

#include "common/util/export.h"
#include "common/util/vec3.h"

namespace intervale {

// world = A (i, j, k) + t. For a diagonal A with positive numbers, the results are those of t + spacing * (i, j, k) to
// the bit.
struct INTERVALE_EXPORT Affine {
  // Row by row, 3 x 4: the first three columns are A, the fourth is t.
  std::array<double, 12> rows{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

  // Axes parallel to the world's.
  [[nodiscard]] static Affine of(const Vec3& spacing, const Vec3& origin = {});
  // A, column by column, and t.
  [[nodiscard]] static Affine of_columns(const std::array<Vec3, 3>& columns, const Vec3& origin);

  // Column 0, 1 or 2: from a sample to the next along that axis. Column 3: t.
  [[nodiscard]] Vec3 column(std::size_t j) const { return {rows[j], rows[4 + j], rows[8 + j]}; }
  [[nodiscard]] Vec3 origin() const { return column(3); }  // of sample (0, 0, 0)
  // Lengths of the columns of A: the distances from a sample to the next along each axis.
  [[nodiscard]] Vec3 spacing() const { return {length(column(0)), length(column(1)), length(column(2))}; }

  [[nodiscard]] Vec3 direction(const Vec3& v) const {  // A v
    return {rows[0] * v[0] + rows[1] * v[1] + rows[2] * v[2], rows[4] * v[0] + rows[5] * v[1] + rows[6] * v[2],
            rows[8] * v[0] + rows[9] * v[1] + rows[10] * v[2]};
  }
  [[nodiscard]] Vec3 point(const Vec3& p) const {  // A p + t
    const Vec3 v = direction(p);
    return {v[0] + rows[3], v[1] + rows[7], v[2] + rows[11]};
  }
  // n A: dot(n, direction(v)) = dot(result, v) for every v. A normal or gradient in the world becomes one in samples;
  // that of the inverse takes one in samples to the world.
  [[nodiscard]] Vec3 transposed(const Vec3& n) const { return {dot(n, column(0)), dot(n, column(1)), dot(n, column(2))}; }
  // Half the sides of the world box around a box in samples, of which these are half the sides.
  [[nodiscard]] Vec3 reach(const Vec3& half) const;

  // The volume of one cell; negative if the map mirrors.
  [[nodiscard]] double determinant() const { return triple_product(column(0), column(1), column(2)); }
  // The same for columns of length 1, which neither overflows nor depends on the spacing. 0 if a column is 0.
  [[nodiscard]] double relative_determinant() const;
  [[nodiscard]] bool is_mirrored() const { return relative_determinant() < 0; }
  // Whether A is diagonal, with positive numbers.
  [[nodiscard]] bool is_axis_parallel() const;
  // From the world to samples. Not singular.
  [[nodiscard]] Affine inverse() const;

  friend bool operator==(const Affine&, const Affine&) = default;
};

// A = Q R by the Gram-Schmidt process: Q is orthogonal, R upper triangular with a positive diagonal. Seen along the
// axes of Q, what a rotation or mirror image of the world does to the map is undone. Q = 1 for an A that is
// axis-parallel. Of a map that is not singular.
struct TurnedAffine {
  explicit TurnedAffine(const Affine& affine);
  std::array<Vec3, 3> axes;  // the columns of Q
  Affine map;                // R, and t along the axes
  // A vector of the world, along the axes.
  [[nodiscard]] Vec3 turned(const Vec3& v) const { return {dot(v, axes[0]), dot(v, axes[1]), dot(v, axes[2])}; }
};

}  // namespace intervale
