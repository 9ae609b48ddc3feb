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

// What one part of a range needs of a brick (find_relevant_updates.h). Immutable. Supercubes are counted within their
// brick, from 0. Memory: 4 bytes a supercube, 8 more unless all updates are relevant; with slopes or distances 2 more,
// and for each relevant update a byte for its distance and half a byte for its slope.
class BrickPart {
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
  BrickPart(const SupercubeSet& set, BrickIndex brick, std::span<const std::uint8_t> steps, std::span<const Supercube> needs, Surface surface);

  // Relevant ones. occupancy: of that supercube.
  [[nodiscard]] std::uint64_t slots(std::size_t supercube, std::uint64_t occupancy) const { return slots_.empty() ? occupancy : slots_[supercube]; }
  [[nodiscard]] unsigned updates() const { return updates_; }  // that are relevant
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  friend class BrickNeeds;
  struct Highest {
    ErrorToDistance to_distance;
    std::uint8_t error_step = 0, slope = 0, distance = 0;
  };
  std::vector<Highest> highest_;         // by supercube
  std::vector<std::uint64_t> slots_;     // by supercube; empty: all
  std::vector<std::uint16_t> first_;     // by supercube: relevant updates before it; empty: nothing is known of them
  std::vector<std::uint8_t> slopes_;     // by two relevant updates, the first in the lower half
  std::vector<std::uint8_t> distances_;  // by relevant update
  unsigned updates_ = 0;
  int scale_ = 0;
};

// What several parts need together: an update is relevant if it is to one of them, and what is known of it is the most
// that any of them knows. As long as the parts.
class BrickNeeds {
 public:
  static constexpr std::size_t kMostParts = 8;  // two surfaces of each of the most ranges that a view shows
  BrickNeeds() = default;                       // nothing
  explicit BrickNeeds(const BrickPart& part) { add(part); }
  // At most kMostParts, each once; all or none have slopes, and distances.
  void add(const BrickPart& part) { parts_[count_++] = &part; }

  // Relevant ones. occupancy: of that supercube.
  [[nodiscard]] std::uint64_t slots(std::size_t supercube, std::uint64_t occupancy) const {
    std::uint64_t slots = 0;
    for (const BrickPart* const part : parts()) slots |= part->slots(supercube, occupancy);
    return slots;
  }
  [[nodiscard]] ErrorToDistance to_distance(std::size_t supercube) const {
    ErrorToDistance most;
    for (const BrickPart* const part : parts()) most = ErrorToDistance::farther(most, part->highest_[supercube].to_distance, part->scale_);
    return most;
  }
  // The highest of a supercube's relevant updates; 0 if there are none, or if they are not known.
  struct Highest {
    std::uint8_t error_step = 0, distance = 0, slope = 0;
  };
  [[nodiscard]] Highest highest(std::size_t supercube) const {
    Highest most;
    for (const BrickPart* const part : parts()) {
      const BrickPart::Highest& one = part->highest_[supercube];
      most = {std::max(most.error_step, one.error_step), std::max(most.distance, one.distance), std::max(most.slope, one.slope)};
    }
    return most;
  }
  // Of one relevant update. relevant: the slots of its supercube that are; 0 where they are not known.
  struct OfUpdate {
    std::uint8_t distance = 0, slope = 0;
  };
  [[nodiscard]] OfUpdate of_update(std::size_t supercube, std::uint64_t relevant, Slot slot) const { return of_supercube(supercube, relevant)(slot); }
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
  // The greatest distance of some updates of a supercube, in a fraction of the time that it takes to ask for each.
  // slots: of these; relevant: as above.
  [[nodiscard]] std::uint8_t farthest(std::size_t supercube, std::uint64_t relevant, std::uint64_t slots) const;
  // At most so many are relevant: no more than a brick may have.
  [[nodiscard]] unsigned updates() const;

 private:
  [[nodiscard]] std::span<const BrickPart* const> parts() const { return {parts_.data(), count_}; }
  std::array<const BrickPart*, kMostParts> parts_{};
  std::size_t count_ = 0;
};

}  // namespace intervale
