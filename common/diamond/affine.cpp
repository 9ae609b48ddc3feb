#include "common/diamond/affine.h"

#include <cmath>

namespace intervale {

Affine Affine::of(const Vec3& spacing, const Vec3& origin) {
  return of_columns({{{spacing[0], 0, 0}, {0, spacing[1], 0}, {0, 0, spacing[2]}}}, origin);
}

Affine Affine::of_columns(const std::array<Vec3, 3>& columns, const Vec3& origin) {
  Affine affine;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) affine.rows[4 * i + j] = columns[j][i];
    affine.rows[4 * i + 3] = origin[i];
  }
  return affine;
}

Vec3 Affine::reach(const Vec3& half) const {
  Vec3 reach{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) reach[i] += std::abs(rows[4 * i + j]) * half[j];
  }
  return reach;
}

double Affine::relative_determinant() const { return triple_product(normalized(column(0)), normalized(column(1)), normalized(column(2))); }

bool Affine::is_axis_parallel() const {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double number = rows[4 * i + j];
      if (i == j ? !(number > 0) : number != 0) return false;
    }
  }
  return true;
}

// By Q and R, so that that of a diagonal map is 1 / spacing to the bit.
Affine Affine::inverse() const {
  const TurnedAffine turned(*this);
  const auto& r = turned.map.rows;
  const double x = 1 / r[0], y = 1 / r[5], z = 1 / r[10];
  const double yz = -(r[6] * z) * y, xy = -(r[1] * y) * x, xz = -(r[1] * yz + r[2] * z) * x;
  const std::array<Vec3, 3> upper{{{x, xy, xz}, {0, y, yz}, {0, 0, z}}};  // the rows of the inverse of R
  Affine inverse;
  const Vec3 t = origin();
  for (std::size_t i = 0; i < 3; ++i) {
    Vec3 row{};
    for (std::size_t k = 0; k < 3; ++k) {
      for (std::size_t j = 0; j < 3; ++j) row[j] += upper[i][k] * turned.axes[k][j];
    }
    for (std::size_t j = 0; j < 3; ++j) inverse.rows[4 * i + j] = row[j];
    inverse.rows[4 * i + 3] = -dot(row, t);
  }
  return inverse;
}

TurnedAffine::TurnedAffine(const Affine& affine) {
  const auto without = [](const Vec3& v, const Vec3& axis) { return subtract(v, scaled(dot(v, axis), axis)); };
  axes[0] = normalized(affine.column(0));
  axes[1] = normalized(without(normalized(affine.column(1)), axes[0]));
  axes[1] = normalized(without(axes[1], axes[0]));  // once more: rounding weighs more, the smaller the angle was
  axes[2] = scaled(affine.is_mirrored() ? -1 : 1, cross(axes[0], axes[1]));
  const Vec3 x = turned(affine.column(0)), y = turned(affine.column(1)), z = turned(affine.column(2));
  map = Affine::of_columns({{{x[0], 0, 0}, {y[0], y[1], 0}, z}}, turned(affine.origin()));
}

}  // namespace intervale
