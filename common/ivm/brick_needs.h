// What ranges need of one brick: which of its updates are relevant, and how far the surfaces around them can move.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/ivm/distance_codes.h"
#include "common/util/bits.h"

namespace intervale {

// Immutable. Supercubes are counted within their brick, from 0. Memory: 4 bytes a supercube, 8 more unless all updates
// are relevant; with slopes or distances 2 more, and for each relevant update a byte for its distance and half a byte
// for its slope; or a pointer to each part that has these.
class BrickNeeds {
 public:
  struct Supercube {
    std::uint64_t slots = 0;  // those that are relevant
    ErrorToDistance to_distance;
  };
  // Known of relevant updates, in order of their numbers; empty: not known.
  struct Surface {
    std::vector<std::uint8_t> slopes = {};  // at most kMaxSlope
    std::vector<std::uint8_t> distances = {};
  };
  // needs: of each supercube of the brick. steps: the error steps of all updates of the set, by number.
  BrickNeeds(const SupercubeSet& set, BrickIndex brick, std::span<const std::uint8_t> steps, std::span<const Supercube> needs, Surface surface);
  static constexpr std::size_t kMostParts = 8;  // two surfaces of each of the most ranges that a view shows
  // What each of the parts needs, of one brick: of an update the most that is known of it. They must outlive it; one to
  // kMostParts, none of several parts itself, and all or none have slopes, and distances.
  BrickNeeds(const SupercubeSet& set, BrickIndex brick, std::vector<const BrickNeeds*> parts);

  // Adds those that have what is known of updates: its parts, or this; none twice.
  void add_parts(std::vector<const BrickNeeds*>& to) const;

  // Relevant ones. occupancy: of that supercube.
  [[nodiscard]] std::uint64_t slots(std::size_t supercube, std::uint64_t occupancy) const { return slots_.empty() ? occupancy : slots_[supercube]; }
  [[nodiscard]] ErrorToDistance to_distance(std::size_t supercube) const { return highest_[supercube].to_distance; }
  // The highest of a supercube's relevant updates; 0 if there are none, or if they are not known.
  [[nodiscard]] std::uint8_t error_step(std::size_t supercube) const { return highest_[supercube].error_step; }
  [[nodiscard]] std::uint8_t slope(std::size_t supercube) const { return highest_[supercube].slope; }
  [[nodiscard]] std::uint8_t distance(std::size_t supercube) const { return highest_[supercube].distance; }
  // Of one relevant update. relevant: the slots of its supercube that are; 0 where they are not known.
  struct OfUpdate {
    std::uint8_t distance = 0, slope = 0;
  };
  [[nodiscard]] OfUpdate of_update(std::size_t supercube, std::uint64_t relevant, Slot slot) const {
    if (parts_.empty()) return own_update(supercube, count_below(relevant, slot));
    OfUpdate most;
    for (const BrickNeeds* const part : parts_) {
      const std::uint64_t slots = part->slots(supercube, relevant);
      if ((slots >> slot & 1) == 0) continue;
      const OfUpdate one = part->own_update(supercube, count_below(slots, slot));
      most = {std::max(most.distance, one.distance), std::max(most.slope, one.slope)};
    }
    return most;
  }
  // of_update() of one supercube, for a loop over its updates. Not for longer than this exists.
  class OfSupercube {
   public:
    [[nodiscard]] OfUpdate operator()(Slot slot) const {
      OfUpdate most;
      for (std::size_t i = 0; i < count_; ++i) {  // without branches on which parts have it: that is hard to foresee
        const Part& one = parts_[i];
        const std::size_t has = one.slots >> slot & 1U, at = has * (one.first + std::size_t(count_below(one.slots, slot)));
        most.distance = std::max(most.distance, std::uint8_t(has * one.distances[at]));
        most.slope = std::max(most.slope, std::uint8_t(has * (one.slopes[at / 2] >> (at % 2 * 4) & 15U)));
      }
      return most;
    }

   private:
    friend class BrickNeeds;
    struct Part {
      std::uint64_t slots = 0;
      const std::uint8_t *distances = nullptr, *slopes = nullptr;
      std::size_t first = 0;  // of the supercube's updates
    };
    std::array<Part, kMostParts> parts_;
    std::size_t count_ = 0;
  };
  [[nodiscard]] OfSupercube of_supercube(std::size_t supercube, std::uint64_t relevant) const;
  [[nodiscard]] unsigned updates() const { return updates_; }  // that are relevant
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Highest {
    ErrorToDistance to_distance;
    std::uint8_t error_step = 0, slope = 0, distance = 0;
  };
  // before: relevant updates of the supercube with lower slots.
  [[nodiscard]] OfUpdate own_update(std::size_t supercube, int before) const {
    if (first_.empty()) return {};
    const std::size_t i = std::size_t(first_[supercube]) + std::size_t(before);
    return {distances_.empty() ? std::uint8_t(0) : distances_[i],
            slopes_.empty() ? std::uint8_t(0) : std::uint8_t(slopes_[i / 2] >> (i % 2 * 4) & 15U)};
  }
  std::vector<Highest> highest_;          // by supercube
  std::vector<std::uint64_t> slots_;      // by supercube; empty: all
  std::vector<std::uint16_t> first_;      // by supercube: how many relevant updates are before it; empty: no need to know
  std::vector<std::uint8_t> slopes_;      // by two relevant updates, the first in the lower half
  std::vector<std::uint8_t> distances_;   // by relevant update
  std::vector<const BrickNeeds*> parts_;  // that have what is known of updates; empty: this has it
  unsigned updates_ = 0;
};

}  // namespace intervale
