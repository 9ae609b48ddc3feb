#include "common/codec/split_names.h"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>
#include <utility>

#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr int kBrickBits = 51;  // of a brick's name within its scale: 17 for each axis
constexpr std::uint64_t kBricks = std::uint64_t(1) << kBrickBits;
constexpr std::size_t kPlainBrickBits = 1 + kBrickBits + 64;  // whether it is there, its name, its mask

// name: the keys of its supercubes without the lowest six bits. mask: which of those are named.
struct Brick {
  std::uint64_t name = 0, mask = 0;
};

// By axis: which supercubes of a brick are the last on it; which bits of a brick's name are its position on it.
constexpr std::array<std::uint64_t, 3> kLast{0xaa00aa00aa00aa00u, 0xcccc0000cccc0000u, 0xf0f0f0f000000000u};
constexpr std::uint64_t kAxis = 0x1249249249249u;

// By supercube: its neighbours in the brick that are one step lower on an axis.
constexpr std::array<std::uint64_t, 64> kBefore = [] {
  std::array<std::uint64_t, 64> before{};
  for (unsigned i = 0; i < 64; ++i) {
    for (unsigned axis = 0; axis < 3; ++axis) {
      const unsigned low = 1u << axis, high = 8u << axis;
      if ((i & low) != 0) before[i] |= std::uint64_t(1) << (i - low);
      if ((i & low) == 0 && (i & high) != 0) before[i] |= std::uint64_t(1) << (i - high + low);
    }
  }
  return before;
}();

// Raw bits of a number, highest first.
template <class Coder>
std::uint64_t code_raw(Coder& coder, int count, std::uint64_t value) {
  std::uint64_t number = 0;
  while (count > 0) {
    const int some = std::min(count, 16);
    count -= some;
    number = number << some | coder.raw_bits(some, unsigned(value >> count) & ((1u << some) - 1));
  }
  return number;
}

// What names bricks and supercubes.
struct NameModels {
  bool is_plain = false;
  std::array<BitModel, 2> is_empty;                        // whether a scale has no bricks; by whether the one before has none
  std::array<BitModel, 2> is_last;                         // whether a brick is its scale's last; by whether it is the first
  std::array<std::array<BitModel, kBrickBits>, 2> longer;  // how many bits a step has; by whether it is a scale's first
  std::array<BitModel, 4> is_named;                        // a supercube; by how many neighbours are

  template <class Coder>
  bool bit(Coder& coder, BitModel& model, bool value) const {
    return is_plain ? coder.raw_bits(1, unsigned(value)) != 0 : coder.bit(model, value);
  }
  // How many bricks lie between two that are named one after the other; below 2^51, or twice that if bytes are damaged.
  template <class Coder>
  std::uint64_t code_gap(Coder& coder, bool is_first, std::uint64_t gap) {
    if (is_plain) return code_raw(coder, kBrickBits, gap);
    const int length = int(std::bit_width(gap + 1)) - 1;
    int n = 0;
    while (n < kBrickBits && coder.bit(longer[is_first][std::size_t(n)], n < length)) ++n;
    return (std::uint64_t(1) << n) + code_raw(coder, n, gap + 1) - 1;
  }
  // beyond: by axis, which supercubes have a named neighbour in the brick before.
  template <class Coder>
  std::uint64_t code_mask(Coder& coder, const std::array<std::uint64_t, 3>& beyond, std::uint64_t mask) {
    std::uint64_t named = 0;
    for (unsigned i = 0; i < 64; ++i) {
      const auto outside = (beyond[0] >> i & 1) + (beyond[1] >> i & 1) + (beyond[2] >> i & 1);
      const auto neighbours = std::size_t(std::popcount(named & kBefore[i])) + std::size_t(outside);
      named |= std::uint64_t(bit(coder, is_named[neighbours], (mask >> i & 1) != 0)) << i;
    }
    return named;
  }
};

// Those supercubes of a brick that have a named neighbour in the brick one step lower, by axis. before: the bricks named
// before, ascending.
std::array<std::uint64_t, 3> beyond_of(std::span<const Brick> before, std::uint64_t name) {
  std::array<std::uint64_t, 3> beyond{};
  for (unsigned axis = 0; axis < 3; ++axis) {
    const std::uint64_t bits = kAxis << axis;
    if ((name & bits) == 0) continue;
    const std::uint64_t neighbour = (name & ~bits) | (((name & bits) - 1) & bits);
    const auto found = std::lower_bound(before.begin(), before.end(), neighbour, [](const Brick& b, std::uint64_t n) { return b.name < n; });
    if (found != before.end() && found->name == neighbour) beyond[axis] = (found->mask & kLast[axis]) >> (9u << axis);
  }
  return beyond;
}

std::vector<Brick> bricks_of(std::span<const SlotGroup> groups) {
  std::vector<Brick> bricks;
  for (const SlotGroup& g : groups) {
    if (bricks.empty() || bricks.back().name != g.key >> 6) bricks.push_back({g.key >> 6, 0});
    bricks.back().mask |= std::uint64_t(1) << (g.key & 63);
  }
  return bricks;
}

// Codes the bricks that an encoder names, or adds those that a decoder finds. Returns what is wrong with those, or null.
template <class Coder>
const char* code_bricks(Coder& coder, bool is_plain, std::size_t most, std::vector<Brick>& bricks) {
  constexpr bool kDecodes = std::is_same_v<Coder, RangeDecoder>;
  NameModels models;
  models.is_plain = is_plain;
  bool is_empty = true;
  std::size_t at = 0, supercubes = 0;
  for (int scale = kMaxLevels - 1; scale >= 0; --scale) {
    const std::uint64_t begin = std::uint64_t(kMaxLevels - scale) << kBrickBits, end = begin + kBricks;
    const auto is_done = [&] { return kDecodes || at == bricks.size() || bricks[at].name >= end; };
    const std::size_t first = at;
    std::uint64_t next = begin;  // the least name that the next brick can have
    is_empty = models.bit(coder, models.is_empty[is_empty], is_done());
    for (bool ends = is_empty; !ends; ends = models.bit(coder, models.is_last[at == first + 1], is_done())) {
      const std::uint64_t gap = models.code_gap(coder, at == first, kDecodes ? 0 : bricks[at].name - next);
      if (gap >= end - next) return "a brick is out of range";
      next += gap;
      const auto beyond = beyond_of(std::span(bricks).first(at), next);
      const std::uint64_t mask = models.code_mask(coder, beyond, kDecodes ? 0 : bricks[at].mask);
      if constexpr (kDecodes) {
        if (coder.is_overdrawn()) return "names of supercubes are missing";
        if (mask == 0) return "a brick has no supercubes";
        supercubes += std::size_t(std::popcount(mask));
        if (supercubes > most) return "too many supercubes";
        bricks.push_back({next, mask});
      }
      ++next;
      ++at;
    }
  }
  return nullptr;
}

// Which slots of a supercube are named; by class and the four before.
struct SlotModels {
  bool is_plain = false;
  std::array<std::array<BitModel, 16>, 3> is_named;

  template <class Coder>
  std::uint64_t code(Coder& coder, std::uint64_t slots = 0) {
    if (is_plain) return code_raw(coder, kSlots, slots);
    std::uint64_t named = 0;
    for (Slot slot{0}; slot < kSlots; ++slot) {
      BitModel& model = is_named[std::size_t(class_of_slot(slot))][named << 4 >> slot & 15];
      named |= std::uint64_t(coder.bit(model, (slots >> slot & 1) != 0)) << slot;
    }
    return named;
  }
};

std::vector<std::uint8_t> coded_splits(std::span<const SlotGroup> groups, bool is_plain) {
  RangeEncoder coder;
  coder.raw_bits(1, unsigned(is_plain));
  encode_supercubes(coder, is_plain, groups);
  SlotModels models;
  models.is_plain = is_plain;
  for (const SlotGroup& g : groups) models.code(coder, g.slots);
  return coder.finish();
}

}  // namespace

void encode_supercubes(RangeEncoder& coder, bool is_plain, std::span<const SlotGroup> groups) {
  std::vector<Brick> bricks = bricks_of(groups);
  RangeEncoder local = std::move(coder);  // in registers
  (void)code_bricks(local, is_plain, groups.size(), bricks);
  coder = std::move(local);
}

std::size_t plain_supercube_bits(std::span<const SlotGroup> groups) {
  std::size_t bricks = 0;
  for (std::size_t g = 0; g < groups.size(); ++g) bricks += std::size_t(g == 0 || groups[g].key >> 6 != groups[g - 1].key >> 6);
  return kMaxLevels + bricks * kPlainBrickBits;
}

Result<std::vector<SupercubeKey>> decode_supercubes(RangeDecoder& coder, bool is_plain, std::size_t most) {
  std::vector<Brick> bricks;
  RangeDecoder local = coder;  // in registers
  if (const char* const wrong = code_bricks(local, is_plain, most, bricks)) return fail(wrong);
  coder = local;
  std::vector<SupercubeKey> keys;
  for (const Brick& b : bricks) {
    for (const int i : set_bits(b.mask)) keys.push_back(b.name << 6 | unsigned(i));
  }
  return keys;
}

std::vector<std::uint8_t> encode_splits(std::span<const SlotGroup> groups) {
  std::vector<std::uint8_t> bytes = coded_splits(groups, false);
  const std::size_t plain_bits = plain_supercube_bits(groups) + kSlots * groups.size();
  return bytes.size() > sizeof(std::uint64_t) + plain_bits / 8 ? coded_splits(groups, true) : bytes;
}

Result<std::vector<SlotGroup>> decode_splits(std::span<const std::uint8_t> bytes, std::size_t most) {
  RangeDecoder coder(bytes);
  SlotModels models;
  models.is_plain = coder.raw_bits(1) != 0;
  const auto keys = decode_supercubes(coder, models.is_plain, most);
  if (!keys) return tl::unexpected(keys.error());
  std::vector<SlotGroup> groups;
  groups.reserve(keys->size());
  for (const SupercubeKey key : *keys) {
    groups.push_back({{}, {}, key, models.code(coder)});
    if (groups.back().slots == 0) return fail("a supercube without a diamond");
  }
  if (!coder.is_spent()) return fail("supercubes and slots do not fit");
  return groups;
}

}  // namespace intervale
