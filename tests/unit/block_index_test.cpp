#include "common/front/block_index.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <map>
#include <random>

namespace intervale {
namespace {

TEST(BlockIndex, FindsWhatWasSetAndNothingElse) {
  std::mt19937 random(5);
  BlockIndex index;
  std::map<std::array<std::int32_t, 4>, std::uint32_t> naive;
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 20000; ++i) {
      const std::int32_t scale = std::int32_t(random() % 19), side = scale < 3 ? 1 << 19 : 40;
      const auto coordinate = [&] { return std::int32_t(random() % std::uint32_t(side)); };
      const Vertex p{coordinate(), coordinate(), coordinate()};
      const auto known = naive.find({scale, p.x, p.y, p.z});
      ASSERT_EQ(index.find(scale, p), known == naive.end() ? BlockIndex::kNone : known->second);
      std::uint32_t& number = index.obtain(scale, p);
      ASSERT_EQ(number, known == naive.end() ? BlockIndex::kNone : known->second);
      number = std::uint32_t(i);
      naive[{scale, p.x, p.y, p.z}] = number;
    }
    for (const auto& [place, number] : naive) ASSERT_EQ(index.find(place[0], {place[1], place[2], place[3]}), number);
    index.clear();
    naive.clear();
  }
}

}  // namespace
}  // namespace intervale
