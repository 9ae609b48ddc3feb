#include "common/codec/split_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <tuple>

#include "common/util/bits.h"

namespace intervale {
namespace {

using Groups = std::vector<SlotGroup>;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMostSplits = 2048;
constexpr std::uint64_t kAllSlots = (std::uint64_t(1) << kSlots) - 1;

Groups in_order(Groups groups) {
  std::sort(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  groups.erase(std::unique(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.key == b.key; }), groups.end());
  return groups;
}

Groups some_groups(unsigned seed) {
  std::mt19937_64 random(seed);
  Groups groups;
  for (unsigned i = 0; i < seed * 50; ++i) {
    const Vertex position{std::int32_t(random() % 40), std::int32_t(random() % 9), std::int32_t(random() % 300)};
    groups.push_back({{}, {}, supercube_key(int(random() % 6), position), (random() & kAllSlots) | 1});
  }
  return in_order(groups);
}

// Anywhere, at all scales, with any slots: nothing that a model could learn.
Groups anywhere(unsigned seed, std::size_t count) {
  std::mt19937_64 random(seed);
  const auto coordinate = [&] { return std::int32_t(random() >> 45); };
  Groups groups;
  while (groups.size() < count) {
    const int scale = int(random() % kMaxLevels);
    const SupercubeKey brick = supercube_key(scale, {coordinate(), coordinate(), coordinate()}) & ~SupercubeKey(63);
    for (const int i : set_bits(std::uint64_t(random())))
      groups.push_back({{}, {}, brick + unsigned(i), std::max<std::uint64_t>(random() & kAllSlots, 1)});
  }
  return in_order(groups);
}

// A sphere's shell at a scale, in supercubes.
Groups shell(int scale, int radius) {
  Groups groups;
  for (int z = 0; z <= 2 * radius; ++z) {
    for (int y = 0; y <= 2 * radius; ++y) {
      for (int x = 0; x <= 2 * radius; ++x) {
        const int d = (x - radius) * (x - radius) + (y - radius) * (y - radius) + (z - radius) * (z - radius);
        if (std::abs(d - radius * radius) <= radius) groups.push_back({{}, {}, supercube_key(scale, {x, y, z}), 0x00ff00ff00ff00u});
      }
    }
  }
  return in_order(groups);
}

std::vector<Groups> sets() {
  std::vector<Groups> all;
  for (unsigned seed = 0; seed < 20; ++seed) all.push_back(some_groups(seed));
  for (unsigned seed = 0; seed < 5; ++seed) all.push_back(anywhere(seed, 1 + 300 * seed));
  all.push_back(shell(0, 9));
  all.push_back(shell(kMaxLevels - 1, 5));
  Groups ends, full;  // the first and the last supercube of each scale; whole bricks
  for (int scale = 0; scale < kMaxLevels; ++scale) {
    ends.push_back({{}, {}, supercube_key(scale, {0, 0, 0}), 1});
    const std::int32_t last = (1 << 19) - 1;
    ends.push_back({{}, {}, supercube_key(scale, {last, last, last}), kAllSlots});
  }
  for (unsigned i = 0; i < 1024; ++i) full.push_back({{}, {}, supercube_key(3, {0, 0, 0}) + 1024 + i, kAllSlots});
  all.push_back(in_order(ends));
  all.push_back(full);
  return all;
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<Groups> decode_exact(const Bytes& bytes, std::size_t size) {
  const auto exact = std::make_unique<std::uint8_t[]>(size);
  std::copy_n(bytes.begin(), size, exact.get());
  return decode_splits({exact.get(), size}, kMostSplits);
}

std::vector<SupercubeKey> keys_of(const Groups& groups) {
  std::vector<SupercubeKey> keys;
  for (const SlotGroup& g : groups) keys.push_back(g.key);
  return keys;
}

Bytes names_of(const Groups& groups, bool is_plain) {
  RangeEncoder coder;
  encode_supercubes(coder, is_plain, groups);
  return coder.finish();
}

// Reads names as PROTOCOL.md describes them, supercube by supercube.
std::vector<SupercubeKey> naive_names(RangeDecoder& coder) {
  std::map<std::tuple<char, int, int>, BitModel> models;
  std::vector<SupercubeKey> keys;
  std::set<std::array<int, 3>> named;  // of the scale
  int is_empty = 1;
  for (int scale = 19; scale >= 0; --scale) {
    named.clear();
    is_empty = int(coder.bit(models[{'e', is_empty, 0}]));
    std::uint64_t next = std::uint64_t(20 - scale) << 51;
    for (int brick = 0, is_last = is_empty; is_last == 0; ++brick) {
      int length = 0;
      while (length < 51 && coder.bit(models[{'g', brick == 0, length}])) ++length;
      std::uint64_t number = 1;
      for (int i = 0; i < length; ++i) number = 2 * number + coder.raw_bits(1);
      const std::uint64_t name = next + number - 1;
      for (unsigned i = 0; i < 64; ++i) {
        const SupercubeKey key = name << 6 | i;
        const Vertex p = position_of_key(key);
        const auto neighbours = named.count({p.x - 1, p.y, p.z}) + named.count({p.x, p.y - 1, p.z}) + named.count({p.x, p.y, p.z - 1});
        if (!coder.bit(models[{'m', int(neighbours), 0}])) continue;
        named.insert({p.x, p.y, p.z});
        keys.push_back(key);
      }
      next = name + 1;
      is_last = int(coder.bit(models[{'l', brick == 0, 0}]));
    }
  }
  return keys;
}

TEST(SplitNames, ComeBackAsTheyWere) {
  for (const Groups& groups : sets()) {
    const auto bytes = encode_splits(groups);
    const auto back = decode_exact(bytes, bytes.size());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, groups);
  }
}

TEST(SplitNames, OfSupercubesComeBackWithModelsAndWithout) {
  for (const Groups& groups : sets()) {
    for (const bool is_plain : {false, true}) {
      const Bytes bytes = names_of(groups, is_plain);
      RangeDecoder coder(bytes);
      const auto keys = decode_supercubes(coder, is_plain, kMostSplits);
      ASSERT_TRUE(keys) << keys.error().message;
      EXPECT_EQ(*keys, keys_of(groups));
      EXPECT_TRUE(coder.is_spent());
    }
  }
}

TEST(SplitNames, AreThoseOfTheNaiveDefinition) {
  for (const Groups& groups : sets()) {
    const Bytes bytes = names_of(groups, false);
    RangeDecoder coder(bytes);
    EXPECT_EQ(naive_names(coder), keys_of(groups));
    EXPECT_TRUE(coder.is_spent());
  }
}

// A session's plan counts on it: 18 bytes a brick, 7 a supercube.
TEST(SplitNames, TakeNoMoreThanTheirBitsWhateverTheyAre) {
  for (const Groups& groups : sets()) {
    std::set<std::uint64_t> bricks;
    for (const SlotGroup& g : groups) bricks.insert(g.key >> 6);
    EXPECT_EQ(plain_supercube_bits(groups), 20 + 116 * bricks.size());
    EXPECT_LE(names_of(groups, true).size(), 8 + plain_supercube_bits(groups) / 8);
    const Bytes bytes = encode_splits(groups);
    EXPECT_LE(bytes.size(), 8 + (plain_supercube_bits(groups) + kSlots * groups.size()) / 8);
    EXPECT_LE(bytes.size(), 18 * bricks.size() + 7 * groups.size() + 64);
  }
  const auto is_plain = [](const Groups& groups) { return RangeDecoder(encode_splits(groups)).raw_bits(1) == 1; };
  EXPECT_TRUE(is_plain(anywhere(7, 20000)));
  EXPECT_FALSE(is_plain(shell(0, 9)));
}

TEST(SplitNames, OfASurfaceTakeAFewBitsASupercube) {
  const Groups groups = shell(2, 20);
  ASSERT_GT(groups.size(), 2000u);
  EXPECT_LT(names_of(groups, false).size(), groups.size() * 3 / 8);
}

// What is missing reads as zeros.
TEST(SplitNames, CutShortOrAddedToAreRefusedOrMeanSomethingElse) {
  for (const Groups& groups : sets()) {
    auto bytes = encode_splits(groups);
    for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 100) {
      const auto back = decode_exact(bytes, size);
      EXPECT_TRUE(!back || *back != groups) << size;
    }
    bytes.push_back(0);
    EXPECT_FALSE(decode_exact(bytes, bytes.size()));
  }
}

TEST(SplitNames, ChangedBytesAreRefusedOrMeanSomethingElseInOrder) {
  for (const Groups& groups : {some_groups(2), anywhere(2, 200), shell(1, 6)}) {
    const auto bytes = encode_splits(groups);
    std::mt19937 random(1);
    for (int trial = 0; trial < 3000; ++trial) {
      auto spoilt = bytes;
      for (int k = 0; k < 3; ++k) spoilt[random() % spoilt.size()] = std::uint8_t(random());
      const auto back = decode_exact(spoilt, spoilt.size());
      if (!back) continue;
      EXPECT_LE(back->size(), kMostSplits);
      for (std::size_t i = 0; i < back->size(); ++i) {
        const SlotGroup& g = (*back)[i];
        EXPECT_NE(g.slots, 0u);
        EXPECT_EQ(g.slots >> kSlots, 0u);
        EXPECT_TRUE(scale_of_key(g.key) >= 0 && scale_of_key(g.key) < kMaxLevels);
        EXPECT_TRUE(i == 0 || (*back)[i - 1].key < g.key);
      }
    }
  }
}

TEST(SplitNames, NoiseIsRefusedOrMeansSomethingInOrder) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    Bytes noise(4 * (random() % 50));
    for (auto& byte : noise) byte = std::uint8_t(random());
    if (!noise.empty() && trial % 2 == 0) noise[0] |= 0x80;  // without models
    RangeDecoder coder(noise);
    const bool is_plain = coder.raw_bits(1) != 0;
    const auto keys = decode_supercubes(coder, is_plain, 100);
    if (!keys) continue;
    EXPECT_LE(keys->size(), 100u);
    EXPECT_TRUE(std::is_sorted(keys->begin(), keys->end(), std::less_equal<>()));
  }
}

TEST(SplitNames, MoreThanThereMayBeAreRefused) {
  const auto groups = some_groups(4);
  ASSERT_GT(groups.size(), 100u);
  const auto bytes = encode_splits(groups);
  EXPECT_TRUE(decode_splits(bytes, groups.size()));
  EXPECT_FALSE(decode_splits(bytes, groups.size() - 1));
}

// A brick takes hardly a bit once its models have learnt: the bound stops them.
TEST(SplitNames, AsManyAsFewBytesCanHoldAreRefusedInTime) {
  Groups groups;
  for (unsigned i = 0; i < 1u << 20; ++i) groups.push_back({{}, {}, supercube_key(0, {0, 0, 0}) + i, 1});
  const Bytes bytes = names_of(groups, false);
  EXPECT_LT(bytes.size(), 4096u);
  RangeDecoder coder(bytes), again(bytes);
  EXPECT_FALSE(decode_supercubes(coder, false, kMostSplits));
  EXPECT_TRUE(decode_supercubes(again, false, groups.size()));
}

}  // namespace
}  // namespace intervale
