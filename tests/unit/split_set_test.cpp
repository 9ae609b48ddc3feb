// Split sets against plain models.
#include "common/diamond/split_set.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <random>
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
    set.for_each_down([&](const Place& p) { expected[p.supercube] |= std::uint64_t(split.contains(p.index)) << p.slot; });
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey) { ASSERT_EQ(split.slots(set.first(b, s), set.occupancy()[s]), expected[s]); });
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
          const UpdateIndex i = set.place_in(b, s, key, slot).index;
          inserts ? expected.insert(i) : expected.erase(i);
        }
        inserts ? split.insert(set.first(b, s), set.occupancy()[s], slots) : split.erase(set.first(b, s), set.occupancy()[s], slots);
      });
    }
    ASSERT_EQ(split, expected);
  }
}

TEST_P(SplitSets, AncestorsAreInsertedBeforeTheirDescendants) {
  const SupercubeSet& set = volume_.set();
  SplitSet split(set.size());
  AncestorInserter inserter(set, split);
  for (int trial = 0; trial < 200; ++trial) {
    const Place place = set.place(UpdateIndex(random_() % set.size()));
    const std::uint64_t occupancy = set.occupancy()[place.supercube];
    const std::uint64_t slots = occupancy & random_() * 0x100000001u & ~split.slots(set.first(place.brick, place.supercube), occupancy);
    if (slots == 0) continue;
    const SplitSet before = split;
    SplitSet expected = split;
    const SplitSet closed = select(set, [&](const Place& p) { return p.supercube == place.supercube && (slots >> p.slot & 1) != 0; });
    for (UpdateIndex i{0}; i < set.size(); ++i) {
      if (closed.contains(i)) expected.insert(i);
    }
    SplitSet replayed = split;
    for (const SlotGroup& g : inserter.insert({place.brick, place.supercube, place.key, slots})) {
      for (const Slot slot : set_bits<Slot>(g.slots)) {
        const Place p = set.place_in(g.brick, g.supercube, g.key, slot);
        testing::for_each_parent(set, p, [&](UpdateIndex parent) { ASSERT_TRUE(replayed.contains(parent)); });
        ASSERT_FALSE(replayed.contains(p.index));
        replayed.insert(p.index);
      }
    }
    ASSERT_EQ(replayed, expected);
    ASSERT_EQ(split, expected);
    if (trial % 2 != 0) continue;
    inserter.take_back();
    ASSERT_EQ(split, before);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, SplitSets, ::testing::Range(0u, 10u));

}  // namespace
}  // namespace intervale
