// What is known of the unsent updates of supercubes, where it is less than of all their updates.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"

namespace intervale {

// Upper bounds on the error steps, distances and slopes of updates. slope_below: at most 15, like slope, of those whose
// object errors are not above the brick's limit; the other slope may be of any.
struct Highest {
  std::uint8_t error_step = 0, distance = 0, slope = 0, slope_below = 0;
  void raise(const Highest& other) {
    error_step = std::max(error_step, other.error_step);
    distance = std::max(distance, other.distance);
    slope = std::max(slope, other.slope);
    slope_below = std::max(slope_below, other.slope_below);
  }
  friend bool operator==(const Highest&, const Highest&) = default;
};

// Bounds of some supercubes, which are counted within their brick. Memory: for each brick that has any, about nine
// bytes, one more for each eight supercubes of which one has, and for each bound as many bits as the differences within
// the brick take, at most 24; for each 32 bricks 8 bytes, and some 20 if any of them has bounds.
class SupercubeBounds {
 public:
  static constexpr std::size_t kBrick = 64;  // most supercubes of one
  // Those of a brick that are kept have a bit in `kept`; the others may be anything. time: when they were valid, as its
  // owner counts.
  struct OfBrick {
    std::uint64_t kept = 0;
    std::uint8_t time = 0;
    std::array<Highest, kBrick> highest;
  };

  explicit SupercubeBounds(std::size_t bricks = 0) : pages_((bricks + kPage - 1) / kPage) {}
  // Overwrites the bounds of a brick that are kept, and tells which.
  void read(BrickIndex brick, OfBrick& to) const;
  // Replaces those of a brick. Moves up to 7 kB. bounds.kept: not 0.
  void write(BrickIndex brick, const OfBrick& bounds);
  [[nodiscard]] std::size_t memory_bytes() const { return pages_.capacity() * sizeof pages_[0] + block_bytes_; }  // with the allocator's

 private:
  // Of a page of bricks: a bit for each brick, whether it has a record; two bytes for each record, where it ends, from
  // the first one's begin; the records. A record: its time; which supercubes, a bit each; a head; the bounds, less the
  // least values, with the bits of each after another's. nullptr: there are none.
  using Block = std::unique_ptr<std::uint8_t[]>;
  static constexpr std::size_t kPage = 32;
  struct Place;
  [[nodiscard]] static Place place(const Block& block, BrickIndex brick);

  std::vector<Block> pages_;
  std::size_t block_bytes_ = 0;
};

}  // namespace intervale
