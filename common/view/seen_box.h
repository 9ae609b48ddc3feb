// A box of the world, among the samples of a grid.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/diamond/diamond.h"
#include "common/diamond/grid.h"
#include "common/util/vec3.h"
#include "common/view/lod.h"

namespace intervale {

// A box of the world, seen from the samples of a grid. Closed. Beyond the samples there is nothing to refine: a box that
// lies there meets nothing.
class SeenBox {
 public:
  SeenBox(const Box& box, const Grid& grid);
  [[nodiscard]] bool contains(const Vec3& sample) const { return meets(sample, {}); }
  // Whether it touches the world box around a box of samples. reach: half the sides of that.
  [[nodiscard]] bool meets(const Vec3& middle, const Vec3& reach) const {
    for (std::size_t i = 0; i < 3; ++i) {
      const double at = dot(across_[i], middle), far = dot(width_[i], reach);
      if (!(at + far >= min_[i] && at - far <= max_[i])) return false;
    }
    return true;
  }
  // The same for the box around a diamond. centre: of the diamond; h: 2^scale.
  [[nodiscard]] bool meets(Vertex centre, std::int32_t h) const {
    for (std::size_t i = 0; i < 3; ++i) {
      const double at = across_[i][0] * centre.x + across_[i][1] * centre.y + across_[i][2] * centre.z;
      if (!(at + h >= min_[i] && at - h <= max_[i])) return false;
    }
    return true;
  }

 private:
  // By axis of the world: its coordinate of a sample, from the first sample, in units of what it changes by from one
  // corner of a cell to another. So a cube of samples with half its side h reaches just as far.
  std::array<Vec3, 3> across_{}, width_{};  // width_: without signs
  Vec3 min_{}, max_{};                      // of the box
};

}  // namespace intervale
