#include "common/diamond/parent_table.h"

namespace intervale {

const std::array<ParentSlots, kSlots>& parents_by_slot() {
  static const auto kTable = [] {
    std::array<ParentSlots, kSlots> table{};
    for (Slot slot{8}; slot < kSlots; ++slot) {
      const unsigned type = kTypeOfSlot[slot];
      table[slot].count = diamond_type(type).parents;
      for (std::size_t k = 0; k < table[slot].count; ++k) {
        const Offset to = diamond_type(type).parent[k];
        const std::array<int, 3> at{int(type & 3) + to.x, int(type >> 2 & 3) + to.y, int(type >> 4 & 3) + to.z};
        const auto place = std::uint8_t(at[0] < 0 ? 1 : at[1] < 0 ? 2 : at[2] < 0 ? 3 : 0);
        table[slot].parent[k] = {kSlotOfType[unsigned(at[0] & 3) | unsigned(at[1] & 3) << 2 | unsigned(at[2] & 3) << 4], place};
      }
    }
    return table;
  }();
  return kTable;
}

ParentTable::ParentTable() {
  std::array<std::array<std::uint64_t, 8 * kBytes>, kPlaces> children{};  // by place and slot of the parent
  for (Slot slot{8}; slot < kSlots; ++slot) {
    const ParentSlots& parents = parents_by_slot()[slot];
    for (std::size_t k = 0; k < parents.count; ++k) children[parents.parent[k].place][parents.parent[k].slot] |= std::uint64_t(1) << slot;
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
