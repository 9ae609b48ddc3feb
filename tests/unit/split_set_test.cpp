// Split sets against plain models.
#include "common/diamond/split_set.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "common/diamond/ancestor_inserter.h"
#include "common/ivm/refinement.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/parents.h"

namespace intervale {
namespace {

constexpr std::array<testing::Dims, 5> kSplitSetBoxes{{{17, 17, 17}, {24, 17, 20}, {33, 12, 7}, {40, 9, 20}, {30, 2, 11}}};

IntervalVolume split_set_volume(unsigned seed) { return testing::build(testing::trial_of_seed(seed, kSplitSetBoxes)); }

// Closed under parents: some of the updates, and their ancestors.
SplitSet some_of(const IntervalVolume& volume, double share, std::mt19937& random) {
  std::bernoulli_distribution wanted(share);
  return select(volume.set(), [&](const Place&) { return wanted(random); });
}

class SplitSets : public ::testing::TestWithParam<unsigned> {
 protected:
  IntervalVolume volume_ = split_set_volume(GetParam());
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(SplitSets, SlotsAreThoseOfTheUpdatesInIt) {
  const SupercubeSet& set = volume_.set();
  for (const double share : {0.0, 0.02, 0.5, 1.0}) {
    const SplitSet split = some_of(volume_, share, random_);
    std::vector<std::uint64_t> expected(set.supercubes());
    set.for_each_down([&](const Place& p) { expected[p.supercube] |= std::uint64_t(split.contains(p)) << p.slot; });
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) { ASSERT_EQ(split.slots(b, key), expected[s]); });
    }
  }
}

// In the keys' order, which is what it is made for, and in any other.
TEST_P(SplitSets, NeighboursAreTheSupercubesFoundByTheirPlaces) {
  const SupercubeSet& set = volume_.set();
  std::vector<SupercubeKey> keys;
  for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
    set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey key) { keys.push_back(key); });
  }
  for (const bool shuffled : {false, true}) {
    if (shuffled) std::shuffle(keys.begin(), keys.end(), random_);
    SetNeighbours around(set);
    for (const SupercubeKey key : keys) {
      around.move_to(key);
      for (int where = 0; where < kNeighbours; ++where) {
        const SupercubePlace there = neighbour_at(where, scale_of_key(key), position_of_key(key));
        const auto found = there.exists() ? set.find_supercube(there.scale, there.position) : std::nullopt;
        const SetFinder::Found& seen = around.at(where);
        ASSERT_EQ(seen.occupancy != 0, found.has_value());
        if (!found) continue;
        ASSERT_EQ(seen.key, found->key);
        ASSERT_EQ(seen.brick, found->brick);
        ASSERT_EQ(seen.supercube, found->supercube);
        ASSERT_EQ(seen.occupancy, set.occupancy()[found->supercube]);
        for (Slot slot{0}; slot < kSlots; ++slot) {
          if (!seen.has(slot)) continue;
          const Place p = set.place_in(found->brick, found->supercube, found->key, slot);
          ASSERT_EQ(seen.index(slot), p.index);
          ASSERT_EQ(seen.place(slot).index, p.index);
        }
      }
    }
  }
}

TEST_P(SplitSets, SlotsAreInsertedAndErasedTogether) {
  const SupercubeSet& set = volume_.set();
  SplitSet expected = some_of(volume_, 0.3, random_), split = expected;
  for (const bool inserts : {true, false}) {
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        const std::uint64_t slots = set.occupancy()[s] & (std::uint64_t(random_()) << 32 | random_());
        for (const Slot slot : set_bits<Slot>(slots)) {
          const Place place = set.place_in(b, s, key, slot);
          inserts ? expected.insert(place) : expected.erase(place);
        }
        inserts ? split.insert(b, key, slots) : split.erase(b, key, slots);
      });
    }
    ASSERT_EQ(split, expected);
  }
}

TEST_P(SplitSets, AncestorsAreInsertedBeforeTheirDescendants) {
  const SupercubeSet& set = volume_.set();
  SplitSet split(set);
  AncestorInserter inserter(set, split);
  for (int trial = 0; trial < 200; ++trial) {
    const Place place = set.place(UpdateIndex(random_() % set.size()));
    const std::uint64_t occupancy = set.occupancy()[place.supercube];
    const std::uint64_t slots = occupancy & random_() * 0x100000001u & ~split.slots(place.brick, place.key);
    if (slots == 0) continue;
    const auto before = split.groups(set);
    SplitSet expected = split;
    const SplitSet closed = select(set, [&](const Place& p) { return p.supercube == place.supercube && (slots >> p.slot & 1) != 0; });
    for (const SlotGroup& g : closed.groups(set)) expected.insert(g.brick, g.key, g.slots);
    SplitSet replayed = split;
    for (const SlotGroup& g : inserter.insert({place.brick, place.supercube, place.key, slots})) {
      for (const Slot slot : set_bits<Slot>(g.slots)) {
        const Place p = set.place_in(g.brick, g.supercube, g.key, slot);
        testing::for_each_parent(set, p, [&](UpdateIndex parent) { ASSERT_TRUE(replayed.contains(set.place(parent))); });
        ASSERT_FALSE(replayed.contains(p));
        replayed.insert(p);
      }
    }
    ASSERT_EQ(replayed, expected);
    ASSERT_EQ(split, expected);
    if (trial % 2 != 0) continue;
    inserter.take_back();
    ASSERT_EQ(split.groups(set), before);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, SplitSets, ::testing::Range(0u, 10u));

// A word for each supercube of some bricks.
using Words = std::map<std::pair<BrickIndex, SupercubeKey>, std::uint64_t>;

void expect_words(const SplitSet& set, const Words& words, std::size_t bricks) {
  std::uint64_t count = 0;
  for (BrickIndex b{0}; b < bricks; ++b) {
    unsigned of_brick = 0;
    for (SupercubeKey place = 0; place < 64; ++place) {
      const auto found = words.find({b, place});
      const std::uint64_t word = found == words.end() ? 0 : found->second;
      ASSERT_EQ(set.slots(b, 640 + place), word);
      of_brick += unsigned(std::popcount(word));
    }
    ASSERT_EQ(set.count(b), of_brick);
    ASSERT_TRUE(set.has_any(b) || of_brick == 0);
    ASSERT_EQ((set.bricks(b / 64 * 64) >> (b % 64) & 1) != 0, set.has_any(b));
    count += of_brick;
  }
  ASSERT_EQ(set.count(), count);
}

TEST(SplitSetLaws, HoldsWhatWasPutInAndNothingElse) {
  constexpr std::size_t kBricks = 150;
  std::mt19937_64 random(3);
  SplitSet set(kBricks);
  Words words;
  for (const std::size_t below : {2u, 40u, unsigned(kBricks)}) {  // dense and sparse parts
    for (int i = 0; i < 4000; ++i) {
      const BrickIndex brick(random() % below);
      const SupercubeKey place = random() % 64;
      const std::uint64_t slots = random() % 2 == 0 ? std::uint64_t(1) << random() % kSlots : random() >> (64 - kSlots);
      std::uint64_t& word = words[{brick, place}];
      if (random() % 2 == 0) {
        set.insert(brick, 640 + place, slots);
        word |= slots;
      } else {
        set.erase(brick, 640 + place, slots);
        word &= ~slots;
      }
      if (random() % 100 == 0) set.settle(random() % 100);
    }
    ASSERT_NO_FATAL_FAILURE(expect_words(set, words, kBricks));
    SplitSet copy = set;
    EXPECT_EQ(copy, set);
    set.settle();
    EXPECT_EQ(copy, set);
    EXPECT_LE(set.memory_bytes(), copy.memory_bytes());
    ASSERT_NO_FATAL_FAILURE(expect_words(set, words, kBricks));
    for (BrickIndex b{0}; b < kBricks; ++b) ASSERT_EQ(set.has_any(b), set.count(b) != 0) << "settled";
    copy.erase(BrickIndex(1), 3, ~std::uint64_t(0));
    copy.insert(BrickIndex(1), 3, 1);
    EXPECT_NE(copy, set);
    EXPECT_NE(set, SplitSet(kBricks));
  }
  for (const auto& [where, word] : words) set.erase(where.first, where.second, word);
  set.settle();
  EXPECT_EQ(set, SplitSet(kBricks));
  EXPECT_EQ(set.memory_bytes(), SplitSet(kBricks).memory_bytes());
}

// More different words than all sets keep once: the rest is in the set.
TEST(SplitSetLaws, HoldsMoreDifferentWordsThanAreKept) {
  constexpr std::size_t kBricks = 1500;
  std::mt19937_64 random(4);
  Words words;
  const auto fill = [&](SplitSet& set) {
    for (BrickIndex b{0}; b < kBricks; ++b) {
      for (SupercubeKey place = 0; place < 64; ++place) set.insert(b, place, words[{b, place}] = 1 + (random() >> 9));
    }
    set.settle();
  };
  {
    SplitSet set(kBricks);
    fill(set);
    ASSERT_NO_FATAL_FAILURE(expect_words(set, words, kBricks));
    SplitSet copy = set;
    EXPECT_GT(set.memory_bytes(), kBricks * 64 * 4);
    set = SplitSet(kBricks);
    ASSERT_NO_FATAL_FAILURE(expect_words(copy, words, kBricks));
    for (const auto& [where, word] : words) copy.erase(where.first, where.second, word);
    copy.settle();
    EXPECT_EQ(copy.memory_bytes(), SplitSet(kBricks).memory_bytes());
  }
  SplitSet few(kBricks);  // those have gone
  for (BrickIndex b{0}; b < kBricks; ++b) {
    for (SupercubeKey place = 0; place < 64; ++place) few.insert(b, place, 1 + random() % 1000);
  }
  few.settle();
  EXPECT_LT(few.memory_bytes(), kBricks * (10 + 64 * 2 + 2));
}

}  // namespace
}  // namespace intervale
