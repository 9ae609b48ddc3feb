#include "common/util/paged_array.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <utility>
#include <vector>

namespace intervale {
namespace {

TEST(PagedArray, IsAVectorWhosePagesMayBeReleased) {
  constexpr std::size_t kSize = 203, kPage = 16;
  std::mt19937 random(1);
  PagedArray<int, kPage> paged(kSize);
  std::vector<int> plain(kSize);
  EXPECT_EQ(paged.pages(), 13U);
  EXPECT_EQ(paged.end_of(12), kSize);
  for (int step = 0; step < 5000; ++step) {
    const std::size_t i = random() % kSize, page = paged.page_of(i);
    const unsigned kind = unsigned(random() % 100);
    if (kind == 0) {
      paged.release_all();
      plain.assign(kSize, 0);
    } else if (kind < 20) {
      paged.release(page);
      EXPECT_FALSE(paged.is_used(page));
      for (std::size_t k = paged.begin_of(page); k < paged.end_of(page); ++k) plain[k] = 0;
    } else {
      paged.use(i) = plain[i] = step;
      EXPECT_TRUE(paged.is_used(page));
    }
    for (std::size_t k = 0; k < kSize; ++k) ASSERT_EQ(std::as_const(paged)[k], plain[k]);
  }
}

TEST(PagedArray, TakesMemoryForPagesThatAreUsed) {
  PagedArray<std::uint32_t, 64> array(64000);
  const std::size_t empty = array.memory_bytes();
  EXPECT_LE(empty, 1000 * sizeof(void*));
  array.use(5) = array.use(63999) = 1;
  EXPECT_GE(array.memory_bytes(), empty + 2 * 64 * 4);
  EXPECT_LE(array.memory_bytes(), empty + 2 * (64 * 4 + 16));
  array.release_all();
  EXPECT_EQ(array.memory_bytes(), empty);
}

}  // namespace
}  // namespace intervale
