// Random affine maps from samples to the world: sheared, turned, permuted and mirrored.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "common/diamond/affine.h"
#include "tests/support/cameras.h"

namespace intervale::testing {

// Axes that are perpendicular, of length 1; right-handed.
inline std::array<Vec3, 3> random_axes(std::mt19937& random) {
  const Vec3 x = random_direction(random);
  Vec3 y;
  do y = random_direction(random);
  while (length(cross(x, y)) < 0.1);
  const Vec3 z = unit(cross(x, y));
  return {x, cross(z, x), z};
}

// The map, then a rotation of the world about its origin.
inline Affine rotated(const Affine& map, const std::array<Vec3, 3>& axes) {
  const Affine turn = Affine::of_columns(axes, {});
  return Affine::of_columns({turn.direction(map.column(0)), turn.direction(map.column(1)), turn.direction(map.column(2))},
                            turn.direction(map.column(3)));
}

// By kind: 0: axes permuted, some of them mirrored; 1: turned; 2: turned and mirrored; 3: sheared; 4: anything.
inline Affine random_affine(std::mt19937& random, unsigned kind) {
  std::array<Vec3, 3> columns{};
  if (kind == 0) {
    std::array<std::size_t, 3> to{0, 1, 2};
    std::shuffle(to.begin(), to.end(), random);
    for (std::size_t j = 0; j < 3; ++j) columns[j][to[j]] = (random() % 2 == 0 ? -1 : 1) * double(1 + random() % 8) / 4;
  } else {
    columns = kind < 3 ? random_axes(random) : std::array<Vec3, 3>{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    for (Vec3& column : columns) column = scaled(uniform(random, 0.3, 3), column);
    if (kind == 2) columns[0] = scaled(-1, columns[0]);
    if (kind == 3) columns[1][0] += uniform(random, -2, 2), columns[2][random() % 2] += uniform(random, -2, 2);
  }
  do {
    for (Vec3& column : columns) {
      for (double& number : column) number += kind == 4 ? uniform(random, -2, 2) : 0;
    }
  } while (kind == 4 && std::abs(Affine::of_columns(columns, {}).relative_determinant()) < 0.05);
  return Affine::of_columns(columns, {uniform(random, -9, 9), uniform(random, -9, 9), uniform(random, -9, 9)});
}

}  // namespace intervale::testing
