#include "server/builder/supercube_family.h"

namespace intervale {

SupercubeDiamonds::SupercubeDiamonds(const std::vector<BorderShapes>& shapes, SupercubeKey key)
    : scale_(scale_of_key(key)), shapes_(shapes[std::size_t(scale_)]) {
  const Vertex p = position_of_key(key);
  corner_ = {4 * p.x, 4 * p.y, 4 * p.z};
  for (int i = 0; i < 4; ++i)
    place_[i] = {shapes_.position(0, corner_.x + i), shapes_.position(1, corner_.y + i), shapes_.position(2, corner_.z + i)};
}

}  // namespace intervale
