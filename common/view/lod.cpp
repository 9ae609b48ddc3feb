#include "common/view/lod.h"

#include <cmath>
#include <cstddef>

namespace intervale {
namespace {

Result<void> check_camera(const Camera& c) {
  if (!is_finite(c.eye) || !is_finite(c.look_at) || !is_finite(c.up)) return misuse("the camera's vectors must be finite");
  const Vec3 ahead = subtract(c.look_at, c.eye);
  if (!(length(ahead) > 0) || !std::isfinite(length(ahead))) return misuse("the camera must look at another point than its own position");
  if (!(length(cross(ahead, c.up)) > 1e-9 * length(ahead) * length(c.up))) return misuse("the camera's up must not be along its line of sight");
  if (!(c.fov > 0 && c.fov < 180)) return misuse("the field of view must be above 0 and below 180 degrees");
  for (const int pixels : c.viewport) {
    if (pixels < 1 || pixels > 65535) return misuse("the viewport must have 1 to 65535 pixels each way");
  }
  if (!std::isfinite(c.pixel_error) || !(c.pixel_error > 0)) return misuse("the pixel error must be a number above 0");
  return {};
}

}  // namespace

Box box_of(const Grid& grid) {
  Box box;
  for (std::size_t i = 0; i < 3; ++i) {
    const double* const row = &grid.affine.rows[4 * i];
    double low = 0, high = 0;  // from the first sample
    for (std::size_t j = 0; j < 3; ++j) (row[j] < 0 ? low : high) += row[j] * (grid.dims[j] - 1);
    box.min[i] = row[3] + low;
    box.max[i] = row[3] + high;
  }
  return box;
}

Result<void> check_lod(const Lod& lod) {
  // Written so that NaN fails each test.
  if (!std::isfinite(lod.error) || lod.error < 0) return misuse("the error of a level of detail must be a number that is not negative");
  if (lod.error_percent && !(*lod.error_percent >= 0 && *lod.error_percent <= 100)) return misuse("the error percent must be a number from 0 to 100");
  if (lod.roi) {
    if (!is_finite(lod.roi->min) || !is_finite(lod.roi->max)) return misuse("the corners of the region of interest must be finite");
    for (int i = 0; i < 3; ++i) {
      if (!(lod.roi->min[i] <= lod.roi->max[i])) return misuse("the region of interest needs its lower corner first: X0 Y0 Z0 X1 Y1 Z1");
    }
  }
  return lod.camera ? check_camera(*lod.camera) : Result<void>{};
}

}  // namespace intervale
