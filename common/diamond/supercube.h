// Supercubes: sets of diamonds found by their centres, at a little over a bit for each.
//
// Kenneth Weiss and Leila De Floriani, "Supercubes: A High-Level Primitive for Diamond Hierarchies", 2009. The 56 types
// of diamonds of one scale that share the centre's higher bits, centre >> (scale + 2), form one supercube. A set of
// diamonds holds, for each supercube that is not empty, its name and one word of occupancy; counting bits gives each
// diamond its number. Up to 64 supercubes form a brick.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/util/bits.h"
#include "common/util/index.h"

namespace intervale {

// A slot is a diamond's number in its supercube: 0..7 class 0, 8..31 class 1, 32..55 class 2, so that parents come
// before children.
using Slot = Index<struct SlotTag, std::uint8_t>;
inline constexpr int kSlots = 56;
extern const std::array<std::uint8_t, kSlots> kTypeOfSlot;
extern const std::array<Slot, 64> kSlotOfType;
[[nodiscard]] constexpr int class_of_slot(Slot slot) { return slot < 8 ? 0 : slot < 32 ? 1 : 2; }
inline constexpr std::array<std::uint64_t, 3> kSlotsOfClass{0xffu, 0xffffff00u, 0xffffff00000000u};

// A supercube's name. Ascending: coarse scales before fine ones, then along a Morton curve.
using SupercubeKey = std::uint64_t;
// position: centre >> (scale + 2); coordinates below 2^19
[[nodiscard]] SupercubeKey supercube_key(int scale, Vertex position);
[[nodiscard]] inline int scale_of_key(SupercubeKey key) { return kMaxLevels - int(key >> 57); }
[[nodiscard]] Vertex position_of_key(SupercubeKey key);
[[nodiscard]] Vertex centre_of(SupercubeKey key, Slot slot);
[[nodiscard]] inline Vertex centre_of(int scale, Vertex position, Slot slot) {
  const unsigned type = kTypeOfSlot[slot];
  const auto coordinate = [scale](std::int32_t high, unsigned low) { return std::int32_t((std::uint32_t(high) << 2 | (low & 3)) << scale); };
  return {coordinate(position.x, type), coordinate(position.y, type >> 2), coordinate(position.z, type >> 4)};
}

// Numbers in a set: of a diamond, a brick and a supercube. That of a diamond is as wide as the size of an array: 64 bits,
// and 32 in a browser. It is only computed, from the number of its supercube: arrays and sets know it by their own order.
using UpdateIndex = Index<struct UpdateTag, std::size_t>;
using BrickIndex = Index<struct BrickTag>;
using SupercubeIndex = Index<struct SupercubeTag>;
inline constexpr std::uint64_t kMostSupercubes = 0xfffffffe;  // in a set
inline constexpr std::uint64_t kMostUpdates = sizeof(UpdateIndex) > 4 ? kMostSupercubes* kSlots : 0xffffffff;

struct Place {
  SupercubeKey key = 0;
  BrickIndex brick;
  SupercubeIndex supercube;
  Slot slot;
  UpdateIndex index;
};

// Some diamonds of one supercube.
struct SlotGroup {
  BrickIndex brick;
  SupercubeIndex supercube;
  SupercubeKey key = 0;
  std::uint64_t slots = 0;
  friend bool operator==(const SlotGroup&, const SlotGroup&) = default;
};

// Visits groups whose keys ascend strictly, children before parents: calls visit(group, slots) with some of the group's
// slots at a time, none of which is another's ancestor.
template <class Visit>
void for_each_finest_first(std::span<const SlotGroup> groups, Visit&& visit) {
  for (std::size_t end = groups.size(), begin = end; end > 0; end = begin) {
    while (begin > 0 && scale_of_key(groups[begin - 1].key) == scale_of_key(groups[end - 1].key)) --begin;
    for (int cls = 2; cls >= 0; --cls) {
      for (std::size_t i = begin; i < end; ++i) {
        if (const std::uint64_t slots = groups[i].slots & kSlotsOfClass[std::size_t(cls)]) visit(groups[i], slots);
      }
    }
  }
}

// An immutable set of diamonds. Supercubes are grouped in bricks: the 4 x 4 x 4 of one scale whose keys differ in the
// lowest six bits only.
class SupercubeSet {
 public:
  SupercubeSet() = default;
  // keys strictly ascending; occupancy not 0 and within kSlots bits, one for each key. At most kMostSupercubes of them, and
  // kMostUpdates diamonds. first: the number of the first one, as if others came before; size() is the number after the
  // last one.
  SupercubeSet(std::span<const SupercubeKey> keys, std::vector<std::uint64_t> occupancy, UpdateIndex first = UpdateIndex());

  struct Brick {
    SupercubeKey key = 0;    // the supercubes' keys with the lowest six bits 0
    std::uint64_t mask = 0;  // which of its 64 supercubes are there
    SupercubeIndex first_supercube;
    UpdateIndex first;  // number of its first diamond
  };

  [[nodiscard]] std::span<const Brick> bricks() const { return bricks_; }
  [[nodiscard]] std::size_t supercubes() const { return occupancy_.size(); }
  [[nodiscard]] std::size_t size() const { return size_; }                               // diamonds
  [[nodiscard]] std::span<const std::uint64_t> occupancy() const { return occupancy_; }  // by supercube
  [[nodiscard]] std::size_t memory_bytes() const { return memory_bytes_of(bricks_.size(), occupancy_.size()); }
  // Of a set with so many bricks and supercubes.
  [[nodiscard]] static std::size_t memory_bytes_of(std::size_t bricks, std::size_t supercubes) {
    return bricks * sizeof(Brick) + supercubes * (sizeof occupancy_[0] + sizeof first_in_brick_[0]) + places(bricks) * sizeof directory_[0];
  }

  // Where a diamond is in the set, if it is. O(1). centre: coordinates in [0, 2^20], not all 0.
  [[nodiscard]] std::optional<Place> find(Vertex centre) const { return find(Diamond(centre)); }
  [[nodiscard]] std::optional<Place> find(const Diamond& d) const;

  // The supercube at a position (not negative), if it is in the set. O(1).
  struct Supercube {
    BrickIndex brick;
    SupercubeIndex supercube;
    SupercubeKey key = 0;
  };
  [[nodiscard]] std::optional<Supercube> find_supercube(int scale, Vertex position) const;
  // The brick at a position, in bricks; not negative.
  [[nodiscard]] std::optional<BrickIndex> find_brick(int scale, Vertex position) const;

  [[nodiscard]] static Vertex centre(const Place& p) { return centre_of(p.key, p.slot); }

  // The place of the diamond with a number. O(log bricks).
  [[nodiscard]] Place place(UpdateIndex index) const;

  // Bricks of one scale: [begin, end).
  [[nodiscard]] std::array<BrickIndex, 2> of_scale(int scale) const {
    return {scale_begin_[kMaxLevels - scale], scale_begin_[kMaxLevels - scale + 1]};
  }

  // Calls visit(supercube, key) for the supercubes of a brick, ascending.
  template <class Visit>
  void for_each_supercube(BrickIndex brick, Visit&& visit) const {
    const Brick& b = bricks_[brick];
    SupercubeIndex supercube = b.first_supercube;
    for (const int i : set_bits(b.mask)) visit(supercube++, b.key + unsigned(i));
  }
  // Calls visit(Place) for those of a brick's diamonds whose slots are among `slots`, in order of their numbers.
  template <class Visit>
  void for_each_in_brick(BrickIndex brick, std::uint64_t slots, Visit&& visit) const {
    for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey key) {
      for (const Slot slot : set_bits<Slot>(occupancy_[s] & slots)) visit(place_in(brick, s, key, slot));
    });
  }
  // The same, for all diamonds of one scale and class.
  template <class Visit>
  void for_each(int scale, int cls, Visit&& visit) const {
    const auto [begin, end] = of_scale(scale);
    for (BrickIndex b = begin; b < end; ++b) for_each_in_brick(b, kSlotsOfClass[cls], visit);
  }
  // The same, for all diamonds: parents before children; or children before parents.
  template <class Visit>
  void for_each_down(Visit&& visit) const {
    for (int scale = kMaxLevels - 1; scale >= 0; --scale) {
      for (int cls = 0; cls < 3; ++cls) for_each(scale, cls, visit);
    }
  }
  template <class Visit>
  void for_each_up(Visit&& visit) const {
    for (int scale = 0; scale < kMaxLevels; ++scale) {
      for (int cls = 2; cls >= 0; --cls) for_each(scale, cls, visit);
    }
  }
  // The number of a brick's diamonds.
  [[nodiscard]] unsigned updates(BrickIndex brick) const {
    return unsigned((brick + 1 < bricks_.size() ? std::size_t(bricks_[brick + 1].first) : size_) - bricks_[brick].first);
  }
  // The number of a supercube's first diamond.
  [[nodiscard]] UpdateIndex first(BrickIndex brick, SupercubeIndex supercube) const { return bricks_[brick].first + first_in_brick_[supercube]; }
  [[nodiscard]] Place place_in(BrickIndex brick, SupercubeIndex supercube, SupercubeKey key, Slot slot) const {
    return {key, brick, supercube, slot, first(brick, supercube) + count_below(occupancy_[supercube], slot)};
  }

 private:
  // Of the directory of so many bricks.
  [[nodiscard]] static constexpr std::size_t places(std::size_t bricks) { return bricks + bricks / 2 + 1; }
  [[nodiscard]] std::size_t home(SupercubeKey brick_key) const;
  [[nodiscard]] std::optional<BrickIndex> find_brick(SupercubeKey brick_key) const;
  std::vector<Brick> bricks_;
  std::vector<std::uint64_t> occupancy_;
  std::vector<std::uint16_t> first_in_brick_;  // at most 63 * 56
  std::vector<std::uint32_t> directory_;       // open addressing: brick number + 1, 0 for an empty place
  std::array<BrickIndex, kMaxLevels + 2> scale_begin_{};
  std::size_t size_ = 0;
};

}  // namespace intervale
