#include "common/selection/packed_splits.h"

#include <array>
#include <bit>

#include "common/codec/range_coder.h"
#include "common/diamond/parent_table.h"
#include "common/util/bits.h"

namespace intervale {
namespace {

// By slot: its parents in the same supercube.
const std::array<std::uint64_t, kSlots>& parents_here() {
  static const auto kTable = [] {
    std::array<std::uint64_t, kSlots> table{};
    for (std::size_t slot = 0; slot < kSlots; ++slot) {
      const ParentSlots& parents = parents_by_slot()[slot];
      for (std::size_t k = 0; k < parents.count; ++k) {
        if (parents.parent[k].place == 0) table[slot] |= std::uint64_t(1) << parents.parent[k].slot;
      }
    }
    return table;
  }();
  return kTable;
}

// Which bricks, supercubes and slots are in a set, each told by what came just before. Coder: see range_coder.h.
template <class Coder>
class SplitsCoder {
 public:
  explicit SplitsCoder(Coder& coder) : coder_(coder) {}
  bool brick(bool has_any = false) { return any(brick_, had_brick_, has_any); }
  bool supercube(bool has_any = false) { return any(supercube_, had_supercube_, has_any); }
  // Of a supercube that has some. A slot whose parents are not all split is hardly ever there.
  std::uint64_t slots(std::uint64_t occupancy, std::uint64_t value = 0) {
    const auto& parents = parents_here();
    std::uint64_t slots = 0;
    bool before = false;
    for (const Slot slot : set_bits<Slot>(occupancy)) {
      const bool lacks_parent = (parents[slot] & occupancy & ~slots) != 0;
      before = coder_.bit(slot_[slot][lacks_parent ? 2 : std::size_t(before)], (value >> slot & 1) != 0);
      slots |= std::uint64_t(before) << slot;
    }
    return slots;
  }

 private:
  using Any = std::array<BitModel, 2>;  // by whether the one before had some
  bool any(Any& model, bool& before, bool has_any) { return before = coder_.bit(model[std::size_t(before)], has_any); }
  Coder& coder_;
  Any brick_, supercube_;
  bool had_brick_ = false, had_supercube_ = false;
  std::array<std::array<BitModel, 3>, kSlots> slot_;
};

}  // namespace

PackedSplits::PackedSplits(const SupercubeSet& set, const SplitSet& splits) {
  RangeEncoder encoder;
  SplitsCoder code(encoder);
  bool is_empty = true;
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    if (!code.brick(!splits.is_untouched(set.bricks()[b].first, set.updates(b)))) continue;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
      const std::uint64_t occupancy = set.occupancy()[s], slots = splits.slots(set.first(b, s), occupancy);
      if (code.supercube(slots != 0)) code.slots(occupancy, slots);
      is_empty = is_empty && slots == 0;
    });
  }
  if (is_empty) return;
  bytes_ = encoder.finish();
  bytes_.shrink_to_fit();
}

SplitSet PackedSplits::unpack(const SupercubeSet& set) const {
  SplitSet splits(set.size());
  if (bytes_.empty()) return splits;
  RangeDecoder decoder(bytes_);
  SplitsCoder code(decoder);
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    if (!code.brick()) continue;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) {
      if (!code.supercube()) return;
      const std::uint64_t occupancy = set.occupancy()[s];
      splits.insert(set.first(b, s), occupancy, code.slots(occupancy));
    });
  }
  return splits;
}

}  // namespace intervale
