// The diamonds of one supercube, and their children: what goes over a set supercube by supercube finds both here without a search for each diamond.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "common/diamond/diamond.h"
#include "common/diamond/supercube.h"
#include "server/builder/outline.h"

namespace intervale {

class SupercubeDiamonds {
 public:
  // outlines: of every scale; they outlive this.
  SupercubeDiamonds(const std::vector<Outlines>& outlines, SupercubeKey key);

  [[nodiscard]] Diamond diamond(int slot) const {
    const unsigned type = kTypeOfSlot[slot];
    return Diamond({(corner_.x + std::int32_t(type & 3)) << scale_, (corner_.y + std::int32_t(type >> 2 & 3)) << scale_,
                    (corner_.z + std::int32_t(type >> 4)) << scale_});
  }
  [[nodiscard]] const Outline& outline(int slot) const {
    const unsigned type = kTypeOfSlot[slot];
    return outlines_.of(place_[type & 3][0], place_[type >> 2 & 3][1], place_[type >> 4][2]);
  }

 private:
  int scale_;
  const Outlines& outlines_;
  Vertex corner_;                            // in units of h
  std::array<std::array<int, 3>, 4> place_;  // of its coordinates: [i][axis]
};

// As far as they are in a set.
class SupercubeChildren {
 public:
  SupercubeChildren(const SupercubeSet& set, SupercubeKey key);

  // A bit for each child that is in the set.
  [[nodiscard]] unsigned of(int slot) const {
    const unsigned type = kTypeOfSlot[slot];
    unsigned some = 0;
    for (int k = 0; k < diamond_type(type).children; ++k) {
      const Place c = places_[type][k];
      some |= unsigned(members(slot, c).occupancy >> c.slot & 1) << k;
    }
    return some;
  }
  // The number in the set of a child that is there.
  [[nodiscard]] UpdateIndex number_of(int slot, int k) const {
    const Place c = places_[kTypeOfSlot[slot]][k];
    const Members& m = members(slot, c);
    return m.first + UpdateIndex(std::popcount(m.occupancy & ((std::uint64_t(1) << c.slot) - 1)));
  }

 private:
  // Where a child is, from the supercube of its parent.
  struct Place {
    std::uint8_t supercube = 0;  // class 0 and 1: 0 the same, 1 + axis the next one along that axis. Class 2, a scale finer: as finer_
    std::uint8_t slot = 0;
  };
  using Places = std::array<std::array<Place, kMaxChildren>, 64>;  // by the parent's type, and the child
  static const Places& places();

  // The diamonds of one supercube: slots, and the number of the first.
  struct Members {
    std::uint64_t occupancy = 0;
    UpdateIndex first = 0;
  };
  [[nodiscard]] const Members& members(int slot, Place c) const { return kSlotsOfClass[2] >> slot & 1 ? finer_[c.supercube] : near_[c.supercube]; }

  const Places& places_ = places();
  std::array<Members, 4> near_;      // itself, and the next ones along the axes
  std::array<Members, 27> finer_{};  // of the next finer scale: from one before its first octant on each axis, x fastest
};

}  // namespace intervale
