#include "common/diamond/parent_table.h"

namespace intervale {

ParentTable::ParentTable() {
  std::array<std::array<std::uint64_t, 8 * kBytes>, kPlaces> children{};  // by place and slot of the parent
  for (Slot slot{8}; slot < kSlots; ++slot) {
    const unsigned type = kTypeOfSlot[slot];
    for (std::size_t k = 0; k < diamond_type(type).parents; ++k) {
      const Offset to = diamond_type(type).parent[k];
      const std::array<int, 3> at{int(type & 3) + to.x, int(type >> 2 & 3) + to.y, int(type >> 4 & 3) + to.z};
      const std::size_t place = at[0] < 0 ? 1 : at[1] < 0 ? 2 : at[2] < 0 ? 3 : 0;
      const Slot parent = kSlotOfType[unsigned(at[0] & 3) | unsigned(at[1] & 3) << 2 | unsigned(at[2] & 3) << 4];
      children[place][parent] |= std::uint64_t(1) << slot;
    }
  }
  for (std::size_t place = 0; place < kPlaces; ++place) {
    for (unsigned parent = 0; parent < 8 * kBytes; ++parent) {
      for (unsigned some = 0; some < 256; ++some) {
        if ((some >> parent % 8 & 1) != 0) children_[place][parent / 8][some] |= children[place][parent];
      }
    }
  }
}

const ParentTable& parent_table() {
  static const ParentTable table;
  return table;
}

}  // namespace intervale
