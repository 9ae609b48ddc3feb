#include "common/diamond/split_set.h"

#include <algorithm>
#include <bit>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace intervale {

namespace {

// See SplitSet::deposit().
std::uint64_t deposit_portably(std::uint64_t bits, std::uint64_t mask) {
  std::uint64_t result = 0;
  for (std::uint64_t left = mask; left != 0; left &= left - 1, bits >>= 1) result |= left & (~left + 1) & (~(bits & 1) + 1);
  return result;
}
// See SplitSet::extract().
std::uint64_t extract_portably(std::uint64_t bits, std::uint64_t mask) {
  std::uint64_t result = 0;
  for (std::uint64_t left = mask, to = 1; left != 0; left &= left - 1, to <<= 1) result |= (bits >> std::countr_zero(left) & 1) != 0 ? to : 0;
  return result;
}
#if defined(__x86_64__)
__attribute__((target("bmi2"))) std::uint64_t deposit_bmi2(std::uint64_t bits, std::uint64_t mask) { return _pdep_u64(bits, mask); }
__attribute__((target("bmi2"))) std::uint64_t extract_bmi2(std::uint64_t bits, std::uint64_t mask) { return _pext_u64(bits, mask); }
const bool kHasBmi2 = __builtin_cpu_supports("bmi2") != 0;
#endif

}  // namespace

void SplitSet::insert_bits(std::size_t w, std::uint64_t bits) {
  for (std::size_t chunk = w * 2; bits != 0; ++chunk, bits >>= 32) {
    if (const auto added = std::uint32_t(bits)) chunks_.update(chunk, [added](std::uint32_t had) { return had | added; });
  }
}

void SplitSet::erase_bits(std::size_t w, std::uint64_t bits) {
  for (std::size_t chunk = w * 2; bits != 0; ++chunk, bits >>= 32) {
    if (const auto had = chunks_.find(chunk)) chunks_.set(chunk, *had & ~std::uint32_t(bits));
  }
}

bool operator==(const SplitSet& a, const SplitSet& b) {
  if (a.chunks_.size() != b.chunks_.size()) return false;
  for (std::size_t chunk = 0; chunk < a.chunks_.size(); ++chunk) {
    if (a.chunks_.get(chunk) != b.chunks_.get(chunk)) return false;
  }
  return true;
}

std::uint64_t SplitSet::count() const {
  std::uint64_t n = 0;
  chunks_.for_each([&n](std::uint32_t bits) { n += std::uint64_t(std::popcount(bits)); });
  return n;
}

unsigned SplitSet::count(UpdateIndex first, unsigned count) const {
  unsigned n = 0;
  if (is_untouched(first, count)) return n;
  for (unsigned at = 0; at < count; at += 64) n += unsigned(std::popcount(some(first + at, std::min(64U, count - at))));
  return n;
}

std::uint64_t SplitSet::deposit(std::uint64_t bits, std::uint64_t mask) {
#if defined(__x86_64__)
  if (kHasBmi2) return deposit_bmi2(bits, mask);
#endif
  return deposit_portably(bits, mask);
}

std::uint64_t SplitSet::extract(std::uint64_t bits, std::uint64_t mask) {
#if defined(__x86_64__)
  if (kHasBmi2) return extract_bmi2(bits, mask);
#endif
  return extract_portably(bits, mask);
}

void SplitSet::insert(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots) {
  const std::uint64_t bits = extract(slots, occupancy);
  const auto shift = unsigned(first % 64);
  insert_bits(first / 64, bits << shift);
  if (shift != 0 && bits >> (64 - shift) != 0) insert_bits(first / 64 + 1, bits >> (64 - shift));
}

void SplitSet::erase(UpdateIndex first, std::uint64_t occupancy, std::uint64_t slots) {
  const std::uint64_t bits = extract(slots, occupancy);
  const auto shift = unsigned(first % 64);
  erase_bits(first / 64, bits << shift);
  if (shift != 0 && bits >> (64 - shift) != 0) erase_bits(first / 64 + 1, bits >> (64 - shift));
}

std::vector<SlotGroup> SplitSet::groups(const SupercubeSet& set) const {
  std::vector<SlotGroup> groups;
  const auto bricks = set.bricks();
  for (BrickIndex b{0}; b < bricks.size(); ++b) {
    if (is_untouched(bricks[b].first, set.updates(b))) continue;
    set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      if (const std::uint64_t some = slots(set.first(b, s), set.occupancy()[s])) groups.push_back({b, s, key, some});
    });
  }
  return groups;
}

}  // namespace intervale
