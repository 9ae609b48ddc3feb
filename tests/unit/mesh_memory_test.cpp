#include <gtest/gtest.h>

#include <cstdint>

#include "common/mesh/mesh.h"

namespace intervale {
namespace {

TEST(MeshMemory, ArraysKeepTheirElementsAsTheyGrowAndShrink) {
  MeshArray<std::uint32_t> array;
  for (std::uint32_t i = 0; i < 3'000'000; ++i) array.push_back(i);  // 12 MB, from small blocks on
  array.resize(2'500'000);
  array.shrink_to_fit();
  const MeshArray<std::uint32_t> copy = array;
  array.resize(10);
  array.shrink_to_fit();
  for (std::uint32_t i = 0; i < 10; ++i) ASSERT_EQ(array[i], i);
  for (std::uint32_t i = 0; i < 2'500'000; ++i) ASSERT_EQ(copy[i], i);
}

}  // namespace
}  // namespace intervale
