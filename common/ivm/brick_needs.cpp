#include "common/ivm/brick_needs.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "common/util/bits.h"

namespace intervale {
namespace {

// Numbers of four bits, two a byte.
std::vector<std::uint8_t> in_halves(std::span<const std::uint8_t> numbers) {
  std::vector<std::uint8_t> result((numbers.size() + 1) / 2);
  for (std::size_t i = 0; i < numbers.size(); ++i) result[i / 2] = std::uint8_t(result[i / 2] | numbers[i] << (i % 2 * 4));
  return result;
}

// Often one of the first relevant updates has the highest step of all.
std::uint8_t highest_step(std::span<const std::uint8_t> steps, std::uint64_t relevant, std::uint64_t occupancy) {
  const std::uint8_t most_of_all = *std::max_element(steps.begin(), steps.end());
  std::uint8_t most = 0;
  for (std::uint64_t left = relevant; left != 0 && most < most_of_all; left &= left - 1)
    most = std::max(most, steps[std::size_t(count_below(occupancy, std::countr_zero(left)))]);
  return most;
}

}  // namespace

BrickPart::BrickPart(const SupercubeSet& set, BrickIndex brick, std::span<const std::uint8_t> steps, std::span<const Supercube> needs,
                     Surface surface)
    : highest_(needs.size()),
      slopes_(in_halves(surface.slopes)),
      distances_(std::move(surface.distances)),
      scale_(scale_of_key(set.bricks()[brick].key)) {
  const bool has_surface = !slopes_.empty() || !distances_.empty();
  if (has_surface) first_.resize(needs.size());
  slots_.resize(needs.size());
  bool is_all = true;
  std::size_t n = 0;
  set.for_each_supercube(brick, [&](SupercubeIndex s, SupercubeKey) {
    const std::uint64_t occupancy = set.occupancy()[s], relevant = needs[n].slots;
    const auto count = unsigned(std::popcount(relevant));
    Highest& highest = highest_[n];
    highest.to_distance = needs[n].to_distance;
    slots_[n] = relevant;
    is_all = is_all && relevant == occupancy;
    if (has_surface) first_[n] = std::uint16_t(updates_);
    if (relevant != 0)
      highest.error_step = highest_step(steps.subspan(set.first(brick, s), std::size_t(std::popcount(occupancy))), relevant, occupancy);
    for (std::size_t i = updates_; !surface.slopes.empty() && i < updates_ + count; ++i) highest.slope = std::max(highest.slope, surface.slopes[i]);
    for (std::size_t i = updates_; !distances_.empty() && i < updates_ + count; ++i) highest.distance = std::max(highest.distance, distances_[i]);
    updates_ += count;
    ++n;
  });
  if (is_all) slots_ = {};
}

std::size_t BrickPart::memory_bytes() const {
  return sizeof *this + highest_.size() * sizeof highest_[0] + slots_.size() * sizeof slots_[0] + first_.size() * sizeof first_[0] + slopes_.size() +
         distances_.size();
}

BrickNeeds::OfSupercube BrickNeeds::of_supercube(std::size_t supercube, std::uint64_t relevant) const {
  static constexpr std::array<std::uint8_t, std::size_t(64) * kSlots> kNotKnown{};  // of as many as a brick has
  OfSupercube result;
  for (const BrickPart* const part : parts()) {
    if (part->first_.empty()) continue;
    result.parts_[result.count_++] = {part->slots(supercube, relevant), part->distances_.empty() ? kNotKnown.data() : part->distances_.data(),
                                      part->slopes_.empty() ? kNotKnown.data() : part->slopes_.data(), part->first_[supercube]};
  }
  return result;
}

std::uint8_t BrickNeeds::farthest(std::size_t supercube, std::uint64_t relevant, std::uint64_t slots) const {
  std::uint8_t most = 0;
  for (const BrickPart* const part : parts()) {
    if (part->distances_.empty() || part->highest_[supercube].distance <= most) continue;
    const std::uint8_t* const distances = part->distances_.data() + part->first_[supercube];
    for (const std::size_t i : set_bits<std::size_t>(extract_bits(slots, part->slots(supercube, relevant)))) most = std::max(most, distances[i]);
  }
  return most;
}

unsigned BrickNeeds::updates() const {
  unsigned sum = 0;
  for (const BrickPart* const part : parts()) sum += part->updates();
  return std::min(sum, unsigned(64 * kSlots));
}

}  // namespace intervale
