#include "common/diamond/parent_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/util/bits.h"

namespace intervale {
namespace {

TEST(ParentTable, SlotsThatLackAParentAreThoseOfTheLinks) {
  std::mt19937_64 random(7);
  for (int trial = 0; trial < 200; ++trial) {
    ParentTable::Words split;
    for (std::uint64_t& word : split) word = trial % 3 == 0 ? random() : random() | random() | random();
    std::uint64_t lacking = 0;
    for (Slot slot{8}; slot < kSlots; ++slot) {
      const Links& links = link_table()[unsigned(trial) % 8][slot];
      for (int k = 0; k < diamond_type(kTypeOfSlot[slot]).parents; ++k) {
        const Link parent = links.vertex[links.parent[std::size_t(k)]];
        const auto* const place = std::find(ParentTable::kNeighbours.begin(), ParentTable::kNeighbours.end(), int(parent.where));
        ASSERT_NE(place, ParentTable::kNeighbours.end()) << "slot " << int(slot) << ", parent " << k;
        if ((split[std::size_t(place - ParentTable::kNeighbours.begin())] >> parent.slot & 1) == 0) lacking |= std::uint64_t(1) << slot;
      }
    }
    EXPECT_EQ(parent_table().lacking(split), lacking) << "trial " << trial;
  }
}

}  // namespace
}  // namespace intervale
