// The supercubes around one, of its scale and of the next coarser: where its diamonds' parents are (links.h).
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "common/diamond/links.h"
#include "common/diamond/supercube.h"

namespace intervale {

// Made to be moved along keys in their order: what was found of a brick's surroundings is kept for its other supercubes.
class Surroundings {
 public:
  explicit Surroundings(const SupercubeSet& set) : set_(set) {}  // which must outlive it

  void move_to(SupercubeKey key);
  [[nodiscard]] int scale() const { return scale_; }
  [[nodiscard]] Vertex position() const { return position_; }
  [[nodiscard]] const Links& links(int slot) const { return (*links_)[std::size_t(slot)]; }

  // A supercube: its first diamond's number, and which it has; none if it is not in the set.
  struct Seen {
    SupercubeKey key = 0;
    std::uint64_t occupancy = 0;
    std::uint32_t brick = 0, supercube = 0;
    UpdateIndex first = 0;
    [[nodiscard]] bool has(unsigned slot) const { return (occupancy >> slot & 1) != 0; }
    [[nodiscard]] UpdateIndex number(unsigned slot) const { return first + UpdateIndex(std::popcount(occupancy & ((std::uint64_t(1) << slot) - 1))); }
    [[nodiscard]] Place place(unsigned slot) const { return {key, brick, supercube, slot, number(slot)}; }
  };
  // where: as in links.h, below kCorner.
  [[nodiscard]] const Seen& at(int where) {
    if (!(known_ >> where & 1)) look(where);
    return seen_[std::size_t(where)];
  }

 private:
  static constexpr std::uint32_t kUnknown = ~std::uint32_t(0), kNone = kUnknown - 1;
  void look(int where);

  const SupercubeSet& set_;
  SupercubeKey key_ = ~SupercubeKey(0), brick_ = key_;
  Vertex brick_position_;                 // in bricks
  std::array<std::uint32_t, 27> same_;    // bricks around that one
  std::array<std::uint32_t, 8> coarser_;  // and of the next coarser scale, from its own half position on
  int scale_ = 0;
  Vertex position_;
  const std::array<Links, kSlots>* links_ = nullptr;
  std::array<Seen, kCorner> seen_;
  std::uint64_t known_ = 0;  // which of those were looked up
};

}  // namespace intervale
