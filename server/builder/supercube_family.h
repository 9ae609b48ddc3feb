// The diamonds of one supercube, with what the box leaves of them.
#pragma once

#include <array>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/supercube.h"
#include "common/ranges/border_shape.h"

namespace intervale {

class SupercubeDiamonds {
 public:
  // shapes: of every scale; they outlive this.
  SupercubeDiamonds(const std::vector<BorderShapes>& shapes, SupercubeKey key);

  [[nodiscard]] Diamond diamond(Slot slot) const {
    const unsigned type = kTypeOfSlot[slot];
    return Diamond({(corner_.x + std::int32_t(type & 3)) << scale_, (corner_.y + std::int32_t(type >> 2 & 3)) << scale_,
                    (corner_.z + std::int32_t(type >> 4)) << scale_});
  }
  [[nodiscard]] const BorderShape& shape(Slot slot) const {
    const unsigned type = kTypeOfSlot[slot];
    return shapes_.of(place_[type & 3][0], place_[type >> 2 & 3][1], place_[type >> 4][2]);
  }

 private:
  int scale_;
  const BorderShapes& shapes_;
  Vertex corner_;                            // in units of h
  std::array<std::array<int, 3>, 4> place_;  // of its coordinates: [i][axis]
};

}  // namespace intervale
