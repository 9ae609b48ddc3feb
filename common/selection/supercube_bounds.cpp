#include "common/selection/supercube_bounds.h"

#include <bit>
#include <cstring>

#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::size_t kHereBytes = 4;                                        // bytes of a bit for each brick
constexpr std::size_t kPast = 4;                                             // bytes that a load may read past the last record
constexpr std::size_t kAllocator = 8;                                        // what an allocator takes for a block; their sum is a multiple of 16
constexpr std::size_t kMostBytes = 1 + 9 + 5 + SupercubeBounds::kBrick * 3;  // of a record

// Bytes of a block whose parts take so many.
std::size_t capacity(std::size_t bytes) { return (bytes + kPast + kAllocator + 15) / 16 * 16 - kAllocator; }

std::uint32_t load16(const std::uint8_t* from) { return from[0] | std::uint32_t(from[1]) << 8; }
std::uint32_t load32(const std::uint8_t* from) { return load16(from) | load16(from + 2) << 16; }
void store16(std::uint8_t* to, std::size_t value) {
  to[0] = std::uint8_t(value);
  to[1] = std::uint8_t(value >> 8);
}
void store32(std::uint8_t* to, std::uint32_t value) {
  store16(to, value & 0xffffU);
  store16(to + 2, value >> 16);
}

// The least of some bounds, and how many bits each takes above it: a record's head, four bytes and one more if there are
// distances.
struct Head {
  Highest least;
  unsigned step = 0, distance = 0, slope = 0, slope_below = 0;  // bits
  [[nodiscard]] unsigned bits() const { return step + distance + slope + slope_below; }
  [[nodiscard]] bool has_distance() const { return least.distance != 0 || distance != 0; }
  [[nodiscard]] std::size_t bytes() const { return has_distance() ? 5 : 4; }
};

Head head_of(const SupercubeBounds::OfBrick& bounds) {
  Head head;
  head.least = {255, 255, 15, 15};
  Highest most;
  for (const std::size_t n : set_bits<std::size_t>(bounds.kept)) {
    const Highest& h = bounds.highest[n];
    most.raise(h);
    head.least.error_step = std::min(head.least.error_step, h.error_step);
    head.least.distance = std::min(head.least.distance, h.distance);
    head.least.slope = std::min(head.least.slope, h.slope);
    head.least.slope_below = std::min(head.least.slope_below, h.slope_below);
  }
  const auto bits = [](std::uint8_t least, std::uint8_t greatest) { return unsigned(std::bit_width(unsigned(greatest) - least)); };
  head.step = bits(head.least.error_step, most.error_step);
  head.distance = bits(head.least.distance, most.distance);
  head.slope = bits(head.least.slope, most.slope);
  head.slope_below = bits(head.least.slope_below, most.slope_below);
  return head;
}

void store(std::uint8_t* to, const Head& h) {
  store32(to, std::uint32_t(h.least.error_step) | std::uint32_t(h.least.slope) << 8 | std::uint32_t(h.least.slope_below) << 12 | h.step << 16 |
                  h.slope << 20 | h.slope_below << 23 | h.distance << 26 | std::uint32_t(h.has_distance()) << 30);
  if (h.has_distance()) to[4] = h.least.distance;
}

Head load_head(const std::uint8_t* from) {
  const std::uint32_t bits = load32(from);
  return {{std::uint8_t(bits), (bits >> 30 & 1) != 0 ? from[4] : std::uint8_t(0), std::uint8_t(bits >> 8 & 15), std::uint8_t(bits >> 12 & 15)},
          bits >> 16 & 15,
          bits >> 26 & 15,
          bits >> 20 & 7,
          bits >> 23 & 7};
}

// Which supercubes, a bit each: which of its bytes are not 0, a bit each; those bytes.
std::uint8_t* store_mask(std::uint8_t* to, std::uint64_t mask) {
  std::uint8_t& which = *to++ = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const auto byte = std::uint8_t(mask >> (8 * i));
    which = std::uint8_t(which | unsigned(byte != 0) << i);
    *to = byte;
    to += byte != 0 ? 1 : 0;
  }
  return to;
}

const std::uint8_t* load_mask(const std::uint8_t* from, std::uint64_t& mask) {
  mask = 0;
  for (const int i : set_bits(*from++)) mask |= std::uint64_t(*from++) << (8 * i);
  return from;
}

// Returns its bytes.
std::size_t encode(const SupercubeBounds::OfBrick& bounds, std::uint8_t* to) {
  const std::uint8_t* const begin = to;
  *to++ = bounds.time;
  to = store_mask(to, bounds.kept);
  const Head head = head_of(bounds);
  store(to, head);
  to += head.bytes();
  std::uint64_t left = 0;
  unsigned bits = 0;
  for (const std::size_t n : set_bits<std::size_t>(bounds.kept)) {
    const Highest& h = bounds.highest[n];
    std::uint32_t packed = std::uint32_t(h.slope_below - head.least.slope_below);
    packed = packed << head.slope | std::uint32_t(h.slope - head.least.slope);
    packed = packed << head.distance | std::uint32_t(h.distance - head.least.distance);
    packed = packed << head.step | std::uint32_t(h.error_step - head.least.error_step);
    left |= std::uint64_t(packed) << bits;
    for (bits += head.bits(); bits >= 8; bits -= 8, left >>= 8) *to++ = std::uint8_t(left);
  }
  if (bits != 0) *to++ = std::uint8_t(left);
  return std::size_t(to - begin);
}

void decode(const std::uint8_t* from, SupercubeBounds::OfBrick& to) {
  to.time = *from++;
  from = load_mask(from, to.kept);
  const Head head = load_head(from);
  from += head.bytes();
  const auto below = [](unsigned bits) { return (std::uint32_t(1) << bits) - 1; };
  const std::uint32_t step = below(head.step), distance = below(head.distance), slope = below(head.slope), slope_below = below(head.slope_below);
  std::size_t at = 0;
  for (const std::size_t n : set_bits<std::size_t>(to.kept)) {
    std::uint32_t packed = load32(from + at / 8) >> (at % 8);
    at += head.bits();
    Highest& h = to.highest[n];
    h.error_step = std::uint8_t(head.least.error_step + (packed & step));
    packed >>= head.step;
    h.distance = std::uint8_t(head.least.distance + (packed & distance));
    packed >>= head.distance;
    h.slope = std::uint8_t(head.least.slope + (packed & slope));
    packed >>= head.slope;
    h.slope_below = std::uint8_t(head.least.slope_below + (packed & slope_below));
  }
}

}  // namespace

// Where a brick's record is in its block, or would be.
struct SupercubeBounds::Place {
  std::uint32_t here = 0;                   // bricks with a record
  std::size_t records = 0, before = 0;      // how many
  std::size_t begin = 0, end = 0, all = 0;  // in bytes, from the first record's begin
  bool is_here = false;
  [[nodiscard]] static std::size_t first(std::size_t records) { return kHereBytes + 2 * records; }
};

SupercubeBounds::Place SupercubeBounds::place(const Block& block, BrickIndex brick) {
  Place p;
  if (!block) return p;
  p.here = load32(block.get());
  p.is_here = (p.here >> (brick % kPage) & 1) != 0;
  p.records = std::size_t(std::popcount(p.here));
  p.before = std::size_t(count_below(p.here, int(brick % kPage)));
  const auto end = [&](std::size_t records) { return records == 0 ? std::size_t(0) : load16(block.get() + kHereBytes + 2 * (records - 1)); };
  p.begin = end(p.before);
  p.end = p.is_here ? end(p.before + 1) : p.begin;
  p.all = end(p.records);
  return p;
}

void SupercubeBounds::read(BrickIndex brick, OfBrick& to) const {
  const Block& block = pages_[brick / kPage];
  const Place p = place(block, brick);
  to.kept = 0;
  if (p.is_here) decode(block.get() + Place::first(p.records) + p.begin, to);
}

void SupercubeBounds::write(BrickIndex brick, const OfBrick& bounds) {
  std::array<std::uint8_t, kMostBytes> record;
  const std::size_t bytes = encode(bounds, record.data());
  Block& block = pages_[brick / kPage];
  const Place p = place(block, brick);
  const std::size_t had = block ? capacity(Place::first(p.records) + p.all) : 0;
  const std::size_t records = p.records + (p.is_here ? 0 : 1), first = Place::first(records), all = p.all - (p.end - p.begin) + bytes;
  const std::size_t needs = capacity(first + all);
  if (had == needs && p.is_here) {
    std::uint8_t* const at = block.get() + first;
    std::memmove(at + p.begin + bytes, at + p.end, p.all - p.end);
    std::memcpy(at + p.begin, record.data(), bytes);
  } else {
    Block grown(new std::uint8_t[needs]);  // the browser's library lacks std::make_unique_for_overwrite
    store32(grown.get(), p.here | std::uint32_t(1) << (brick % kPage));
    if (block) {
      const std::uint8_t* const from = block.get() + Place::first(p.records);
      std::memcpy(grown.get() + kHereBytes, block.get() + kHereBytes, 2 * p.before);
      std::memcpy(grown.get() + kHereBytes + 2 * (p.before + 1), block.get() + kHereBytes + 2 * (p.before + (p.is_here ? 1 : 0)),
                  2 * (records - p.before - 1));
      std::memcpy(grown.get() + first, from, p.begin);
      std::memcpy(grown.get() + first + p.begin + bytes, from + p.end, p.all - p.end);
    }
    std::memcpy(grown.get() + first + p.begin, record.data(), bytes);
    block = std::move(grown);
    block_bytes_ += needs + kAllocator - (had == 0 ? 0 : had + kAllocator);
  }
  std::uint8_t* const ends = block.get() + kHereBytes;
  store16(ends + 2 * p.before, p.begin + bytes);
  for (std::size_t i = p.before + 1; i < records; ++i) store16(ends + 2 * i, load16(ends + 2 * i) + bytes - (p.end - p.begin));
}

}  // namespace intervale
