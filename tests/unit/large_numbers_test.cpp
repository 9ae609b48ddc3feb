// Numbers of diamonds and elements beyond 2^32, without as many of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "common/diamond/domain.h"
#include "common/diamond/split_set.h"
#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"
#include "common/ivm/value_volume.h"

namespace intervale::large_numbers {
namespace {

constexpr std::size_t k2To32 = std::size_t(1) << 32;

struct SomeSupercubes {
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
};

// Some of those of a box of 64 x 64 x 64, each with some of its diamonds.
SomeSupercubes some_supercubes(std::uint32_t seed) {
  std::mt19937_64 random(seed);
  std::map<SupercubeKey, std::uint64_t> words;
  for (int i = 0; i < 300; ++i) {
    const int scale = int(random() % 4), side = 16 >> scale;
    const auto coordinate = [&] { return std::int32_t(random() % std::uint64_t(side)); };
    const Vertex p{coordinate(), coordinate(), coordinate()};
    words[supercube_key(scale, p)] = (random() & ((std::uint64_t(1) << kSlots) - 1)) | 1;
  }
  SomeSupercubes some;
  for (const auto& [key, word] : words) some.keys.push_back(key), some.occupancy.push_back(word);
  return some;
}

// Where 2^32 falls: on the first diamond, in the middle, behind the last one, and far below them.
class SetsFromNumber : public ::testing::TestWithParam<std::size_t> {
 protected:
  SomeSupercubes some_ = some_supercubes(11);
  SupercubeSet low_{some_.keys, some_.occupancy};
  SupercubeSet high_{some_.keys, some_.occupancy, UpdateIndex(GetParam())};
  [[nodiscard]] UpdateIndex raised(UpdateIndex i) const { return i + GetParam(); }
};

TEST_P(SetsFromNumber, HaveTheSameDiamondsAndTheirNumbersAreThatMuchGreater) {
  ASSERT_EQ(high_.size(), low_.size() + GetParam());
  ASSERT_EQ(high_.bricks().size(), low_.bricks().size());
  for (BrickIndex b{0}; b < low_.bricks().size(); ++b) {
    ASSERT_EQ(high_.bricks()[b].first, raised(low_.bricks()[b].first));
    ASSERT_EQ(high_.updates(b), low_.updates(b));
  }
  std::size_t next = GetParam();
  for (BrickIndex b{0}; b < high_.bricks().size(); ++b) {
    high_.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) { ASSERT_EQ(p.index, next++); });
  }
  ASSERT_EQ(next, high_.size());
  SetNeighbours around_low(low_), around_high(high_);
  low_.for_each_down([&](const Place& p) {
    const auto found = high_.find(SupercubeSet::centre(p));
    ASSERT_TRUE(found);
    ASSERT_EQ(found->index, raised(p.index));
    const Place place = high_.place(raised(p.index));
    ASSERT_EQ(place.key, p.key);
    ASSERT_EQ(place.slot, p.slot);
    ASSERT_EQ(place.index, found->index);
    std::vector<UpdateIndex> parents, of_high;
    for_each_parent(around_low, p.key, p.slot, [&](const SetNeighbours::Diamond& parent) { parents.push_back(raised(parent.index())); });
    for_each_parent(around_high, p.key, p.slot, [&](const SetNeighbours::Diamond& parent) { of_high.push_back(parent.index()); });
    ASSERT_EQ(of_high, parents);
  });
}

TEST_P(SetsFromNumber, SplitsAreThoseThatWereInserted) {
  std::mt19937 random(3);
  SplitSet split(high_), one_by_one(high_);
  std::map<SupercubeKey, std::uint64_t> expected;
  for (BrickIndex b{0}; b < high_.bricks().size(); ++b) {
    high_.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
      const std::uint64_t occupancy = high_.occupancy()[s];
      std::uint64_t wanted = 0;
      for (const Slot slot : set_bits<Slot>(occupancy)) wanted |= std::uint64_t(random() % 3 == 0) << unsigned(slot);
      if (wanted == 0) return;
      expected[key] = wanted;
      split.insert(b, key, occupancy);
      split.erase(b, key, occupancy & ~wanted);
      for (const Slot slot : set_bits<Slot>(wanted)) one_by_one.insert(high_.place_in(b, s, key, slot));
    });
  }
  std::map<SupercubeKey, std::uint64_t> found;
  for (const SlotGroup& g : split.groups(high_)) found[g.key] = g.slots;
  EXPECT_EQ(found, expected);
  std::uint64_t count = 0;
  for (const auto& [key, slots] : expected) count += std::uint64_t(std::popcount(slots));
  EXPECT_EQ(split.count(), count);
  EXPECT_EQ(one_by_one.count(), count);
  for (BrickIndex b{0}; b < high_.bricks().size(); ++b) {
    high_.for_each_in_brick(b, ~std::uint64_t(0), [&](const Place& p) { ASSERT_EQ(split.contains(p), one_by_one.contains(p)); });
  }
}

INSTANTIATE_TEST_SUITE_P(Numbers, SetsFromNumber,
                         ::testing::Values(std::size_t(5), k2To32 - 100'000, k2To32 - 3'000, k2To32 - 17, k2To32, 2 * k2To32 + 29));

// Whatever the sides: the flattest boxes have the most supercubes.
TEST(LargeNumbers, OfAsManySamplesAsAreAllowedSupercubesHaveNumbers) {
  const auto supercubes_at_most = [](const std::array<std::int32_t, 3>& dims) {
    const Domain domain(dims);
    std::uint64_t count = 0;
    for (int scale = 0; scale < domain.levels(); ++scale) {
      const Vertex last = last_supercube(domain, scale);
      count += std::uint64_t(last.x + 1) * std::uint64_t(last.y + 1) * std::uint64_t(last.z + 1);
    }
    return count;
  };
  std::vector<std::int64_t> sides;
  for (std::int64_t side = kMinSide; side <= kMaxSide; side = side < 40 ? side + 1 : side * 5 / 4) sides.push_back(side);
  for (std::int64_t power = 8; power <= kMaxSide; power *= 2)
    sides.insert(sides.end(), {power - 1, power, std::min<std::int64_t>(power + 1, kMaxSide)});
  std::uint64_t most = 0;
  for (const std::int64_t x : sides) {
    for (const std::int64_t y : sides) {
      const std::int64_t z = std::min<std::int64_t>(std::int64_t(kMostSamples) / (x * y), kMaxSide);
      if (z < kMinSide) continue;
      most = std::max(most, supercubes_at_most({std::int32_t(x), std::int32_t(y), std::int32_t(z)}));
    }
  }
  EXPECT_LE(most, kMostSupercubes);
  EXPECT_GT(most, kMostSupercubes / 2) << "the limit could be higher";
  EXPECT_LE(supercubes_at_most({4096, 4096, 4096}), kMostSupercubes / 3);
}

}  // namespace
}  // namespace intervale::large_numbers
