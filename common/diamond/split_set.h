// The split diamonds as a set of updates, and the diamonds that can be split next: all that a server knows of a
// client's mesh.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"

namespace intervale {

// A set of updates: one bit for each, by number.
class SplitSet {
 public:
  explicit SplitSet(std::uint32_t size = 0) : words_((std::size_t(size) + 63) / 64) {}
  [[nodiscard]] bool contains(UpdateIndex i) const { return words_[i / 64] >> (i % 64) & 1; }
  // Which of `count` updates from `first` on are in it, a bit each; count in [1, 64].
  [[nodiscard]] std::uint64_t some(UpdateIndex first, unsigned count) const {
    const unsigned shift = first % 64;
    std::uint64_t bits = words_[first / 64] >> shift;
    if (shift + count > 64) bits |= words_[first / 64 + 1] << (64 - shift);
    return bits & (~std::uint64_t(0) >> (64 - count));
  }
  void insert(UpdateIndex i) { words_[i / 64] |= std::uint64_t(1) << (i % 64); }
  void erase(UpdateIndex i) { words_[i / 64] &= ~(std::uint64_t(1) << (i % 64)); }
  [[nodiscard]] std::uint64_t count() const;
  // The slots of a supercube's diamonds that are in it; inserts and erases some. occupancy: of that supercube, not 0,
  // and the slots are among it; first: the number of its first diamond.
  [[nodiscard]] std::uint64_t slots(UpdateIndex first, std::uint64_t occupancy) const;
  void insert(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots);
  void erase(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots);
  [[nodiscard]] std::vector<SlotGroup> groups(const SupercubeSet& set) const;  // all of it, in order
  [[nodiscard]] std::vector<std::uint64_t>& words() { return words_; }
  friend bool operator==(const SplitSet&, const SplitSet&) = default;

 private:
  std::vector<std::uint64_t> words_;
};

// Tells which diamonds of a supercube have all their parents split.
class SplittableSlots {
 public:
  // All must outlive it; `split` must not change between move_to() and slots().
  SplittableSlots(const SupercubeSet& set, const Domain& domain, const SplitSet& split) : domain_(domain), split_(split), around_(set) {}

  void move_to(SupercubeKey key);

  // At the supercube that it moved to.
  [[nodiscard]] SetNeighbours& around() { return around_; }

  // The slots of diamonds that exist, whose split would not be a no-op, and whose parents are split, whether they are
  // split themselves or not.
  [[nodiscard]] std::uint64_t slots();

 private:
  // The split slots of a neighbour.
  [[nodiscard]] std::uint64_t split_slots(int where);
  [[nodiscard]] std::uint64_t slots_inside();
  const Domain& domain_;
  const SplitSet& split_;
  SetNeighbours around_;
  std::array<std::uint64_t, kCorner> split_slots_{};  // by neighbour
  std::uint64_t known_ = 0;                           // a bit for each that was looked up
};

}  // namespace intervale
