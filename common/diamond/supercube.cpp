#include "common/diamond/supercube.h"

#include <algorithm>
#include <cassert>

namespace intervale {
namespace {

constexpr std::array<std::uint8_t, kSlots> types_by_slot() {
  std::array<std::uint8_t, kSlots> types{};
  int n = 0;
  for (int cls = 0; cls < 3; ++cls) {
    for (unsigned type = 0; type < 64; ++type) {
      const int odd = int(type & 1) + int(type >> 2 & 1) + int(type >> 4 & 1);
      if (odd == 3 - cls) types[n++] = std::uint8_t(type);
    }
  }
  return types;
}

constexpr std::array<Slot, 64> slots_by_type() {
  std::array<Slot, 64> slots{};
  const auto types = types_by_slot();
  for (Slot s{0}; s < kSlots; ++s) slots[types[s]] = s;
  return slots;
}

// Bits 0, 1, 2, ... to bits 0, 3, 6, ..., and back; 21 bits.
constexpr std::uint64_t spread(std::uint64_t v) {
  v &= 0x1fffff;
  v = (v | v << 32) & 0x1f00000000ffff;
  v = (v | v << 16) & 0x1f0000ff0000ff;
  v = (v | v << 8) & 0x100f00f00f00f00f;
  v = (v | v << 4) & 0x10c30c30c30c30c3;
  return (v | v << 2) & 0x1249249249249249;
}
constexpr std::int32_t gather(std::uint64_t v) {
  v &= 0x1249249249249249;
  v = (v | v >> 2) & 0x10c30c30c30c30c3;
  v = (v | v >> 4) & 0x100f00f00f00f00f;
  v = (v | v >> 8) & 0x1f0000ff0000ff;
  v = (v | v >> 16) & 0x1f00000000ffff;
  return std::int32_t((v | v >> 32) & 0x1fffff);
}

}  // namespace

constinit const std::array<std::uint8_t, kSlots> kTypeOfSlot = types_by_slot();
constinit const std::array<Slot, 64> kSlotOfType = slots_by_type();

SupercubeKey supercube_key(int scale, Vertex p) {
  return std::uint64_t(kMaxLevels - scale) << 57 | spread(std::uint64_t(p.x)) | spread(std::uint64_t(p.y)) << 1 | spread(std::uint64_t(p.z)) << 2;
}

Vertex position_of_key(SupercubeKey key) {
  const std::uint64_t morton = key & ((std::uint64_t(1) << 57) - 1);
  return {gather(morton), gather(morton >> 1), gather(morton >> 2)};
}

Vertex centre_of(SupercubeKey key, Slot slot) { return centre_of(scale_of_key(key), position_of_key(key), slot); }

SupercubeSet::SupercubeSet(std::span<const SupercubeKey> keys, std::vector<std::uint64_t> occupancy, UpdateIndex first)
    : occupancy_(std::move(occupancy)), size_(first) {
  assert(keys.size() == occupancy_.size() && "one word for each supercube");
  first_in_brick_.reserve(keys.size());
  for (SupercubeIndex s{0}; s < keys.size(); ++s) {
    const SupercubeKey brick = keys[s] & ~SupercubeKey(63);
    if (bricks_.empty() || bricks_.back().key != brick) bricks_.push_back({brick, 0, s, UpdateIndex(size_)});
    bricks_.back().mask |= std::uint64_t(1) << (keys[s] & 63);
    first_in_brick_.push_back(std::uint16_t(size_ - bricks_.back().first));
    size_ += std::size_t(std::popcount(occupancy_[s]));
  }
  bricks_.shrink_to_fit();
  directory_.assign(places(bricks_.size()), 0);
  for (std::uint32_t b = 0; b < bricks_.size(); ++b) {
    std::size_t i = home(bricks_[b].key);
    while (directory_[i] != 0) i = i + 1 == directory_.size() ? 0 : i + 1;
    directory_[i] = b + 1;
  }
  for (std::size_t i = 0; i < scale_begin_.size(); ++i) {
    const auto before = [](const Brick& b, SupercubeKey key) { return b.key < key; };
    scale_begin_[i] = BrickIndex(std::lower_bound(bricks_.begin(), bricks_.end(), std::uint64_t(i) << 57, before) - bricks_.begin());
  }
}

std::size_t SupercubeSet::home(SupercubeKey brick_key) const {
  std::uint64_t h = (brick_key >> 6) * 0x9e3779b97f4a7c15u;
  h ^= h >> 32;
  h *= 0xd6e8feb86659fd93u;
  return std::size_t((unsigned __int128)(h)*directory_.size() >> 64);
}

std::optional<BrickIndex> SupercubeSet::find_brick(SupercubeKey brick_key) const {
  if (bricks_.empty()) return {};
  for (std::size_t i = home(brick_key); directory_[i] != 0; i = i + 1 == directory_.size() ? 0 : i + 1) {
    if (bricks_[directory_[i] - 1].key == brick_key) return BrickIndex(directory_[i] - 1);
  }
  return {};
}

std::optional<BrickIndex> SupercubeSet::find_brick(int scale, Vertex position) const {
  if (scale >= kMaxLevels) return {};
  return find_brick(supercube_key(scale, {4 * position.x, 4 * position.y, 4 * position.z}));
}

std::optional<SupercubeSet::Supercube> SupercubeSet::find_supercube(int scale, Vertex position) const {
  if (scale >= kMaxLevels) return {};
  const SupercubeKey key = supercube_key(scale, position);
  const auto b = find_brick(key & ~SupercubeKey(63));
  const int i = int(key & 63);
  if (!b || !(bricks_[*b].mask >> i & 1)) return {};
  return Supercube{*b, bricks_[*b].first_supercube + count_below(bricks_[*b].mask, i), key};
}

std::optional<Place> SupercubeSet::find(const Diamond& d) const {
  if (d.row->cls == 3) return {};
  const int up = d.scale + 2;
  const auto found = find_supercube(d.scale, {d.centre.x >> up, d.centre.y >> up, d.centre.z >> up});
  const Slot slot = kSlotOfType[d.type];
  if (!found || !(occupancy_[found->supercube] >> slot & 1)) return {};
  return place_in(found->brick, found->supercube, found->key, slot);
}

Place SupercubeSet::place(UpdateIndex index) const {
  const auto after = [](UpdateIndex i, const Brick& b) { return i < b.first; };
  const auto brick = BrickIndex(std::upper_bound(bricks_.begin(), bricks_.end(), index, after) - bricks_.begin() - 1);
  SupercubeIndex s = bricks_[brick].first_supercube;
  std::uint64_t mask = bricks_[brick].mask;
  auto skip = std::uint32_t(index - bricks_[brick].first);
  for (; skip >= std::uint32_t(std::popcount(occupancy_[s])); ++s, mask &= mask - 1) skip -= std::uint32_t(std::popcount(occupancy_[s]));
  std::uint64_t word = occupancy_[s];
  for (; skip > 0; --skip) word &= word - 1;
  return {bricks_[brick].key + unsigned(std::countr_zero(mask)), brick, s, Slot(std::countr_zero(word)), index};
}

}  // namespace intervale
