#include <cmath>

#include "common/mesh/mesh.h"
#include "common/util/vec3.h"

namespace intervale {

// A. Neumaier, Rundungsfehleranalyse einiger Verfahren zur Summation endlicher Summen, ZAMM 54, 1974.
double volume_of(const Mesh& mesh) {
  double sum = 0, lost = 0;
  for (const auto& tet : mesh.tets) {
    const auto& origin = mesh.points[tet[0]];
    const auto from_origin = [&](int corner) { return subtract(mesh.points[tet[corner]], origin); };
    const double six_fold = triple_product(from_origin(1), from_origin(2), from_origin(3));
    const double next = sum + six_fold;
    lost += std::abs(sum) >= std::abs(six_fold) ? (sum - next) + six_fold : (six_fold - next) + sum;
    sum = next;
  }
  return (sum + lost) / 6;
}

}  // namespace intervale
