// The patch of a surface in a tetrahedron: the flat polygon where the linear interpolant has the surface's value.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "common/ranges/cube_crossings.h"
#include "common/util/vec3.h"

namespace intervale {

struct PatchPolygon {
  // The corners of a tetrahedron, and the values there. No polygon if all of these are on one side.
  PatchPolygon(const std::array<Vec3, 4>& at, const std::array<double, 4>& values, const Isosurface& surface) {
    std::array<int, 4> order{0, 1, 2, 3};  // those on the side of the first, and then the others
    int alike = 1;
    for (int i = 1; i < 4; ++i) {
      if (!surface.separates(values[0], values[i])) std::swap(order[alike++], order[i]);
    }
    const auto cut = [&](int a, int b) { corner[count++] = lerp(at[a], at[b], part_of(surface.value, values[a], values[b])); };
    const auto [a, b, c, d] = order;
    switch (alike) {
      case 1:
        cut(a, b), cut(a, c), cut(a, d);
        break;
      case 2:
        cut(a, c), cut(a, d), cut(b, d), cut(b, c);
        break;
      case 3:
        cut(a, d), cut(b, d), cut(c, d);
        break;
      default:
        break;
    }
  }

  [[nodiscard]] Vec3 middle() const {
    Vec3 sum{};
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < 3; ++k) sum[k] += corner[i][k] / count;
    return sum;
  }

  std::array<Vec3, 4> corner{};  // in order around it
  int count = 0;
};

// The sides of a patch, for many distances.
class PatchBorder {
 public:
  PatchBorder() = default;
  explicit PatchBorder(const PatchPolygon& patch) : is_empty_(patch.count == 0) {
    for (int i = 0; i < 4; ++i) {  // of a triangle, one twice
      const int from = i < patch.count ? i : 0;
      const Vec3 &a = patch.corner[from], along = subtract(patch.corner[from + 1 < patch.count ? from + 1 : 0], a);
      const double square = dot(along, along);
      for (int k = 0; k < 3; ++k) {
        from_[k][i] = a[k];
        along_[k][i] = along[k];
      }
      inverse_square_[i] = square > 0 ? 1 / square : 0;
    }
  }

  // The square of a point's distance to the nearest side; infinite without a patch.
  [[nodiscard]] double squared_distance(const Vec3& p) const {
    if (is_empty_) return std::numeric_limits<double>::infinity();
    const Lanes x = p[0] - from_[0], y = p[1] - from_[1], z = p[2] - from_[2];
    const Lanes on_line = (x * along_[0] + y * along_[1] + z * along_[2]) * inverse_square_;
    const Lanes positive = on_line > 0 ? on_line : Lanes{}, t = positive < 1 ? positive : Lanes{} + 1;
    const Lanes dx = x - t * along_[0], dy = y - t * along_[1], dz = z - t * along_[2];
    const Lanes square = dx * dx + dy * dy + dz * dz;
    return std::min(std::min(square[0], square[1]), std::min(square[2], square[3]));
  }

 private:
  using Lanes [[gnu::vector_size(4 * sizeof(double))]] = double;  // by side
  std::array<Lanes, 3> from_{}, along_{};
  Lanes inverse_square_{};
  bool is_empty_ = true;
};

}  // namespace intervale
