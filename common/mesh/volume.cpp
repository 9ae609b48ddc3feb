#include <array>
#include <cmath>

#include "common/mesh/mesh.h"

namespace intervale {

// A. Neumaier, Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen, ZAMM 54, 1974.
double volume_of(const Mesh& mesh) {
  double sum = 0, lost = 0;
  for (const auto& tet : mesh.tets) {
    const auto& origin = mesh.points[tet[0]];
    std::array<std::array<double, 3>, 3> e;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) e[i][axis] = mesh.points[tet[i + 1]][axis] - origin[axis];
    const double six_fold = (e[0][1] * e[1][2] - e[0][2] * e[1][1]) * e[2][0] + (e[0][2] * e[1][0] - e[0][0] * e[1][2]) * e[2][1] +
                            (e[0][0] * e[1][1] - e[0][1] * e[1][0]) * e[2][2];
    const double next = sum + six_fold;
    lost += std::abs(sum) >= std::abs(six_fold) ? (sum - next) + six_fold : (six_fold - next) + sum;
    sum = next;
  }
  return (sum + lost) / 6;
}

}  // namespace intervale
