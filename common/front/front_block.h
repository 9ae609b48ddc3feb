// One supercube of a front: its splits, and their values. Inside the front.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "common/diamond/diamond.h"
#include "common/diamond/supercube.h"
#include "common/front/slot_array.h"
#include "common/patch/range.h"
#include "common/patch/value_format.h"
#include "common/util/bits.h"

namespace intervale {

// A point of the mesh: a cut, or a centre inside the range. It stays the same until the front forgets splits
// (FrontState::point_generation).
using PointId = std::uint32_t;
inline constexpr std::size_t kMostPoints = 0xffffffff;  // of a front

// A split, as bits: 2 v for a cut of alpha on the edge from the centre to local vertex v, 2 v + 1 for one of beta;
// above them the centre's side.
struct FrontSplit {
  static constexpr int kSideBit = 2 * kMaxVertices;
  static constexpr std::uint32_t kCutBits = (1u << kSideBit) - 1;

  std::uint32_t bits = 0;
  // Of its cuts, in order of their bits; if the centre is inside, that is the point after the last one
  PointId first = 0;
  [[nodiscard]] Side side() const { return Side(bits >> kSideBit); }
  [[nodiscard]] std::uint32_t cut_bits() const { return bits & kCutBits; }
  [[nodiscard]] PointId cut(int bit) const { return first + PointId(count_below(bits, bit)); }
  [[nodiscard]] PointId centre() const { return first + PointId(std::popcount(cut_bits())); }
  [[nodiscard]] std::uint32_t points() const { return centre() - first + (side() == Side::inside); }
  // The sides of the diamond's vertices, as DiamondContext has them; pairs: DiamondContext::pairs.
  [[nodiscard]] std::uint32_t vertex_sides(std::uint32_t pairs) const {
    const std::uint32_t alpha = bits & pairs, beta = bits >> 1 & pairs;
    if (side() == Side::below) return (alpha & ~beta) | beta << 1;
    if (side() == Side::inside) return (pairs & ~(alpha | beta)) | beta << 1;
    return (beta & ~alpha) | (pairs & ~beta) << 1;
  }
  // Which of the two surfaces cut the edge to local vertex v: bit 0 alpha, bit 1 beta.
  [[nodiscard]] unsigned cuts_to(int v) const { return bits >> (2 * v) & 3; }
  [[nodiscard]] int cut_count(int v) const { return std::popcount(cuts_to(v)); }
};

// Splits by slot, in seven bytes each.
class SlotSplits {
 public:
  [[nodiscard]] std::uint64_t slots() const { return bytes_.slots(); }  // that were set
  [[nodiscard]] bool has(std::size_t slot) const { return bytes_.has(slot); }
  // Of a slot that was set.
  [[nodiscard]] FrontSplit operator[](std::size_t slot) const {
    const std::uint8_t* const from = bytes_.at(slot);
    FrontSplit split;
    std::memcpy(&split.first, from, sizeof split.first);
    split.bits = std::uint32_t(from[4]) | std::uint32_t(from[5]) << 8 | std::uint32_t(from[6]) << 16;
    return split;
  }
  void set(std::size_t slot, const FrontSplit& split) { store(bytes_.obtain(slot, kBytes), split); }
  void clear() { bytes_.replace(0, kBytes); }
  // Keeps the splits of `slots`, all of which were set, and no others.
  void keep(std::uint64_t slots) { bytes_.reshape(slots, kBytes); }
  // Replaces all: with split_of(slot), called for each of `slots` in ascending order.
  template <class SplitOf>
  void assign(std::uint64_t slots, const SplitOf& split_of) {
    bytes_.replace(slots, kBytes);
    std::uint8_t* to = begin();
    for (const int slot : set_bits(slots)) {
      store(to, split_of(std::size_t(slot)));
      to += kBytes;
    }
  }
  // Gives the points of all splits numbers that are greater by so many.
  void renumber(PointId by) {
    std::uint8_t* to = begin();
    for (int left = std::popcount(slots()); left > 0; --left) {
      PointId first = 0;
      std::memcpy(&first, to, sizeof first);
      first += by;
      std::memcpy(to, &first, sizeof first);
      to += kBytes;
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const { return bytes_.memory_bytes(); }

 private:
  static constexpr std::size_t kBytes = 7;
  static_assert(FrontSplit::kSideBit + 2 <= 8 * (int(kBytes) - int(sizeof(PointId))));
  static void store(std::uint8_t* to, const FrontSplit& split) {
    std::memcpy(to, &split.first, sizeof split.first);
    for (int i = 0; i < 3; ++i) to[4 + i] = std::uint8_t(split.bits >> (8 * i));
  }
  [[nodiscard]] std::uint8_t* begin() { return slots() == 0 ? nullptr : bytes_.at(std::size_t(std::countr_zero(slots()))); }
  SlotBytes bytes_;
};

struct FrontBlock {
  using Split = FrontSplit;

  Vertex position;  // centre >> (scale + 2)
  std::int32_t scale = 0;
  std::uint64_t split = 0;  // slots
  SlotKeys key;             // of those that are split, or were
  std::uint64_t shown = 0;  // those of `split` that the mesh is made with; the others are hidden
  // The sides of the centres of those of `split`, and which of them count for the range
  std::uint64_t inside = 0, above = 0, counts = 0;
  // Bounds of the keys at the centres and the vertices of the diamonds that are split, or were
  ValueKey least = ~ValueKey(0), greatest = 0;
  SlotSplits placed;  // the splits that are shown and have points, or were and had

  [[nodiscard]] bool is_split(Slot slot) const { return (split >> slot & 1) != 0; }
  [[nodiscard]] bool is_shown(Slot slot) const { return (shown >> slot & 1) != 0; }
  [[nodiscard]] bool is_counting(Slot slot) const { return (counts >> slot & 1) != 0; }
  [[nodiscard]] Side side(Slot slot) const { return Side((inside >> slot & 1) | (above >> slot & 1) << 1); }
  void set_side(Slot slot, Side side) {
    inside = (inside & ~(std::uint64_t(1) << slot)) | std::uint64_t(side == Side::inside) << slot;
    above = (above & ~(std::uint64_t(1) << slot)) | std::uint64_t(side == Side::above) << slot;
  }
  // Of a split that is shown. A split without points is nothing but its side.
  [[nodiscard]] Split split_at(Slot slot) const {
    if (placed.has(slot)) return placed[slot];
    return {std::uint32_t(side(slot)) << Split::kSideBit, 0};
  }
  // Sets the split of a diamond, whose centre's side is set.
  void place(Slot slot, const Split& s) {
    if (s.points() != 0 || placed.has(slot)) placed.set(slot, s);
  }
  [[nodiscard]] std::size_t memory_bytes() const { return sizeof(*this) + key.memory_bytes() + placed.memory_bytes(); }
};

}  // namespace intervale
