#include "common/codec/split_names.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

namespace intervale {
namespace {

constexpr std::size_t kMostSplits = 2048;

std::vector<SlotGroup> some_groups(unsigned seed) {
  std::mt19937_64 random(seed);
  std::vector<SlotGroup> groups;
  for (unsigned i = 0; i < seed * 50; ++i) {
    const Vertex position{std::int32_t(random() % 40), std::int32_t(random() % 9), std::int32_t(random() % 300)};
    const std::uint64_t slots = random() & ((std::uint64_t(1) << kSlots) - 1);
    groups.push_back({{}, {}, supercube_key(int(random() % 6), position), slots | 1});
  }
  std::sort(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.key < b.key; });
  groups.erase(std::unique(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.key == b.key; }), groups.end());
  return groups;
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<std::vector<SlotGroup>> decode_exact(const std::vector<std::uint8_t>& bytes, std::size_t size) {
  const auto exact = std::make_unique<std::uint8_t[]>(size);
  std::copy_n(bytes.begin(), size, exact.get());
  return decode_splits({exact.get(), size}, kMostSplits);
}

TEST(SplitNames, ComeBackAsTheyWere) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const auto groups = some_groups(seed);
    const auto bytes = encode_splits(groups);
    const auto back = decode_exact(bytes, bytes.size());
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(*back, groups);
  }
}

TEST(SplitNames, CutShortOrAddedToAreRefused) {
  auto bytes = encode_splits(some_groups(3));
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(decode_exact(bytes, size)) << size;
  bytes.push_back(0);
  EXPECT_FALSE(decode_exact(bytes, bytes.size()));
}

TEST(SplitNames, ChangedBytesAreRefusedOrMeanSomethingElseInOrder) {
  const auto bytes = encode_splits(some_groups(2));
  std::mt19937 random(1);
  for (int trial = 0; trial < 5000; ++trial) {
    auto spoilt = bytes;
    for (int k = 0; k < 3; ++k) spoilt[random() % spoilt.size()] = std::uint8_t(random());
    const auto back = decode_exact(spoilt, spoilt.size());
    if (!back) continue;
    EXPECT_LE(back->size(), kMostSplits);
    for (std::size_t i = 0; i < back->size(); ++i) {
      EXPECT_NE((*back)[i].slots, 0u);
      EXPECT_EQ((*back)[i].slots >> kSlots, 0u);
      EXPECT_TRUE(i == 0 || (*back)[i - 1].key < (*back)[i].key);
    }
  }
}

TEST(SplitNames, MoreThanThereMayBeAreRefused) {
  const auto groups = some_groups(4);
  ASSERT_GT(groups.size(), 100u);
  const auto bytes = encode_splits(groups);
  EXPECT_TRUE(decode_splits(bytes, groups.size()));
  EXPECT_FALSE(decode_splits(bytes, groups.size() - 1));
}

}  // namespace
}  // namespace intervale
