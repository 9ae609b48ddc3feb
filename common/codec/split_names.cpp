#include "common/codec/split_names.h"

#include <bit>
#include <string>

#include "common/codec/byte_planes.h"

namespace intervale {
namespace {

constexpr int kCompression = 1;     // zstd: on such planes faster and smaller than 3
constexpr unsigned kSlotBytes = 7;  // of a word of slots
static_assert(kSlots == 8 * kSlotBytes);

}  // namespace

void append_supercubes(std::vector<std::uint8_t>& out, std::span<const SlotGroup> groups) {
  // Each brick as the step from the one before, and a word: which of its supercubes are there.
  std::vector<std::uint8_t> steps;
  std::vector<std::uint64_t> masks;
  std::uint64_t previous = 0;
  for (const SlotGroup& g : groups) {
    const std::uint64_t brick = g.key >> 6;
    if (masks.empty() || brick != previous) {
      append_varint(steps, brick - previous);
      masks.push_back(0);
      previous = brick;
    }
    masks.back() |= std::uint64_t(1) << (g.key & 63);
  }
  append_plane(out, steps, kCompression);
  append_plane(out, split_bytes(masks, 8), kCompression);
}

Result<std::vector<SupercubeKey>> take_supercubes(std::span<const std::uint8_t>& bytes, std::size_t most) {
  const auto steps = take_plane(bytes, 10 * most), masks = take_plane(bytes, 8 * most);
  if (!steps || !masks || masks->size() % 8 != 0) return fail("the names of supercubes are damaged");
  std::vector<SupercubeKey> keys;
  std::span<const std::uint8_t> left(*steps);
  std::uint64_t brick = 0;
  bool is_first = true;
  for (std::uint64_t mask : join_bytes(*masks, 8)) {
    const auto step = take_varint(left);
    if (!step || (!is_first && *step == 0) || *step >= (std::uint64_t(1) << 56) - brick || mask == 0) return fail("bricks do not ascend");
    is_first = false;
    brick += *step;
    const SupercubeKey key = brick << 6;
    if (scale_of_key(key) < 0 || scale_of_key(key) >= kMaxLevels) return fail("a brick of no scale");
    if (keys.size() + std::size_t(std::popcount(mask)) > most) return fail("too many supercubes");
    for (; mask != 0; mask &= mask - 1) keys.push_back(key + unsigned(std::countr_zero(mask)));
  }
  if (!left.empty()) return fail("bricks and their supercubes do not add up");
  return keys;
}

std::vector<std::uint8_t> encode_splits(std::span<const SlotGroup> groups) {
  std::vector<std::uint8_t> out;
  append_supercubes(out, groups);
  std::vector<std::uint64_t> slots;
  for (const SlotGroup& g : groups) slots.push_back(g.slots);
  append_plane(out, split_bytes(slots, kSlotBytes), kCompression);
  return out;
}

Result<std::vector<SlotGroup>> decode_splits(std::span<const std::uint8_t> bytes, std::size_t most) {
  const auto keys = take_supercubes(bytes, most);
  if (!keys) return tl::unexpected(keys.error());
  const auto slots = take_plane(bytes, kSlotBytes * keys->size());
  if (!slots || slots->size() != kSlotBytes * keys->size() || !bytes.empty()) return fail("supercubes and slots do not fit");
  std::vector<SlotGroup> groups;
  groups.reserve(keys->size());
  const auto words = join_bytes(*slots, kSlotBytes);
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (words[k] == 0) return fail("a supercube without a diamond");
    groups.push_back({{}, {}, (*keys)[k], words[k]});
  }
  return groups;
}

}  // namespace intervale
