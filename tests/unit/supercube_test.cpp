#include "common/diamond/supercube.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

namespace intervale {
namespace {

TEST(Supercube, EveryCentreHasOneNameAndSlot) {
  std::mt19937 random(5);
  for (int i = 0; i < 100000; ++i) {
    const int bits = int(random() % 21);
    const auto coordinate = [&] { return std::int32_t(random() & ((1u << bits) - 1)) & ~((1 << random() % 4) - 1); };
    const Vertex c{coordinate(), coordinate(), coordinate()};
    if ((c.x | c.y | c.z) == 0) continue;
    const Diamond d(c);
    const int up = d.scale + 2;
    const SupercubeKey key = supercube_key(d.scale, {c.x >> up, c.y >> up, c.z >> up});
    EXPECT_EQ(centre_of(key, kSlotOfType[d.type]), c);
    EXPECT_EQ(scale_of_key(key), d.scale);
  }
}

TEST(Supercube, SlotsGoByClass) {
  for (Slot slot{0}; slot < kSlots; ++slot) {
    EXPECT_EQ(kSlotsOfClass[diamond_type(kTypeOfSlot[slot]).cls] >> slot & 1, 1u);
    EXPECT_EQ(kSlotOfType[kTypeOfSlot[slot]], slot);
  }
}

TEST(Supercube, ASetFindsWhatIsInItAndNothingElse) {
  std::mt19937 random(9);
  std::set<std::array<int, 3>> members;
  std::map<SupercubeKey, std::uint64_t> words;
  for (int i = 0; i < 5000; ++i) {
    const Vertex c{int(random() % 65), int(random() % 65), int(random() % 65)};
    if ((c.x | c.y | c.z) == 0 || scale_of(c) >= kMaxLevels) continue;
    const Diamond d(c);
    const int up = d.scale + 2;
    words[supercube_key(d.scale, {c.x >> up, c.y >> up, c.z >> up})] |= std::uint64_t(1) << kSlotOfType[d.type];
    members.insert({c.x, c.y, c.z});
  }
  std::vector<SupercubeKey> keys;
  std::vector<std::uint64_t> occupancy;
  for (const auto& [key, word] : words) keys.push_back(key), occupancy.push_back(word);
  const SupercubeSet set(keys, occupancy);
  EXPECT_EQ(set.size(), members.size());
  std::set<UpdateIndex> numbers;
  for (int z = 0; z < 65; ++z) {
    for (int y = 0; y < 65; ++y) {
      for (int x = 0; x < 65; ++x) {
        if ((x | y | z) == 0) continue;
        const auto place = set.find({x, y, z});
        ASSERT_EQ(place.has_value(), members.contains({x, y, z}));
        if (!place) continue;
        numbers.insert(place->index);
        EXPECT_EQ(set.centre(*place), (Vertex{x, y, z}));
        EXPECT_EQ(set.place(place->index).slot, place->slot);
        EXPECT_EQ(set.place(place->index).supercube, place->supercube);
      }
    }
  }
  EXPECT_EQ(numbers.size(), members.size());
  int last = -1;
  set.for_each_down([&](const Place& p) {
    const Diamond d(set.centre(p));
    const int depth = 3 * (kMaxLevels - d.scale) + d.row->cls;
    EXPECT_GE(depth, last);
    last = depth;
  });
}

}  // namespace
}  // namespace intervale
