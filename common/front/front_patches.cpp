#include "common/front/front_patches.h"

namespace intervale {

FrontPatches::Corners FrontPatches::corners_of(const TetShape& s) {
  Corners corners;
  for (int c = 0; c < kPatchCorners; ++c) corners[c] = c < 4 ? s.vertex[c] : std::uint8_t(kCutsFrom + 2 * s.edge[(c - 4) / 2] + (c & 1));
  return corners;
}

const FrontPatches::HalfCorners& FrontPatches::half_corners() {
  static const std::unique_ptr<const HalfCorners> table = [] {
    auto made = std::make_unique<HalfCorners>();
    for (int slot = 0; slot < kSlots; ++slot) {
      const DiamondType& row = diamond_type(kTypeOfSlot[slot]);
      for (int t = 0; t < row.tets; ++t) {
        for (int end = 0; end < 2; ++end) (*made)[slot][t][end] = corners_of(row.half_shape[t][end]);
      }
    }
    return made;
  }();
  return *table;
}

bool FrontPatches::can_change_child(Vertex centre) const {
  const Diamond child(centre);
  const int up = child.scale + 2;
  Front::Cursor cursor(front_);
  cursor.move_to(child.scale, {centre.x >> up, centre.y >> up, centre.z >> up});
  return cursor.gather(kSlotOfType[child.type]) && !cursor.is_idle() && cursor.context_.is_mixed();
}

}  // namespace intervale
