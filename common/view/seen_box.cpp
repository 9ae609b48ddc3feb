#include "common/view/seen_box.h"

#include <cmath>
#include <limits>

namespace intervale {

SeenBox::SeenBox(const Box& box, const Grid& grid) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const double* const row = &grid.affine.rows[4 * i];
    const double unit = std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]);
    double first = 0, last = 0;  // of the samples
    for (std::size_t j = 0; j < 3; ++j) {
      across_[i][j] = row[j] / unit;
      width_[i][j] = std::abs(across_[i][j]);
      (row[j] < 0 ? first : last) += across_[i][j] * (grid.dims[j] - 1);
    }
    min_[i] = (box.min[i] - row[3]) / unit;
    max_[i] = (box.max[i] - row[3]) / unit;
    if (min_[i] > last) min_[i] = kInfinity;
    if (max_[i] < first) max_[i] = -kInfinity;
  }
}

}  // namespace intervale
