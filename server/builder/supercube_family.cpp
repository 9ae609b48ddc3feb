#include "server/builder/supercube_family.h"

namespace intervale {

SupercubeDiamonds::SupercubeDiamonds(const std::vector<Outlines>& outlines, SupercubeKey key)
    : scale_(scale_of_key(key)), outlines_(outlines[std::size_t(scale_)]) {
  const Vertex p = position_of_key(key);
  corner_ = {4 * p.x, 4 * p.y, 4 * p.z};
  for (int i = 0; i < 4; ++i) place_[i] = {outlines_.place(0, corner_.x + i), outlines_.place(1, corner_.y + i), outlines_.place(2, corner_.z + i)};
}

const SupercubeChildren::Places& SupercubeChildren::places() {
  static const Places places = [] {
    Places all{};
    for (unsigned type = 0; type < 64; ++type) {
      const DiamondType& row = diamond_type(type);
      const std::array<int, 3> at{int(type & 3), int(type >> 2 & 3), int(type >> 4)};
      for (int k = 0; k < row.children; ++k) {
        const std::array<int, 3> step{row.child[k].child.x, row.child[k].child.y, row.child[k].child.z};
        Place& child = all[type][k];
        unsigned child_type = 0;
        for (int axis = 0, power = 1; axis < 3; ++axis, power *= 3) {
          const int c = row.cls == 2 ? 2 * at[axis] + step[axis] : at[axis] + step[axis];  // in [-1, 7] or [0, 4]
          child_type |= unsigned(c & 3) << (2 * axis);
          if (row.cls == 2) child.supercube = std::uint8_t(child.supercube + power * ((c + 4) / 4));
          if (row.cls != 2 && c == 4) child.supercube = std::uint8_t(1 + axis);
        }
        child.slot = kSlotOfType[child_type];
      }
    }
    return all;
  }();
  return places;
}

SupercubeChildren::SupercubeChildren(const SupercubeSet& set, SupercubeKey key) {
  const int scale = scale_of_key(key);
  const Vertex p = position_of_key(key);
  const auto members_of = [&set](int of_scale, Vertex position) {
    const auto found = set.find_supercube(of_scale, position);
    return found ? Members{set.occupancy()[found->supercube], set.first(found->brick, found->supercube)} : Members{};
  };
  near_ = {members_of(scale, p), members_of(scale, {p.x + 1, p.y, p.z}), members_of(scale, {p.x, p.y + 1, p.z}),
           members_of(scale, {p.x, p.y, p.z + 1})};
  if (scale == 0 || (near_[0].occupancy & kSlotsOfClass[2]) == 0) return;
  for (int i = 0; i < 27; ++i) {
    const Vertex q{2 * p.x + i % 3 - 1, 2 * p.y + i / 3 % 3 - 1, 2 * p.z + i / 9 - 1};
    if (q.x >= 0 && q.y >= 0 && q.z >= 0) finer_[i] = members_of(scale - 1, q);
  }
}

}  // namespace intervale
