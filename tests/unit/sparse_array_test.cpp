#include "common/util/sparse_array.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <optional>
#include <random>

namespace intervale {
namespace {

constexpr std::size_t kElements = 1500;  // some pages, the last one not full

class SparseArrays : public ::testing::TestWithParam<std::size_t> {};  // how many elements are used, at most

TEST_P(SparseArrays, HoldWhatWasSetAndNothingElse) {
  std::mt19937 random(7);
  SparseArray<std::uint64_t> array(kElements);
  std::map<std::size_t, std::uint64_t> model;
  for (std::size_t n = 0; n < GetParam(); ++n) {
    const std::size_t i = random() % kElements;
    model[i] = random();
    array.set(i, model[i]);
  }
  for (std::size_t i = 0; i < kElements; ++i) {
    const auto found = model.find(i);
    EXPECT_EQ(array.find(i), found == model.end() ? std::nullopt : std::optional(found->second));
    EXPECT_EQ((array.used(i / 64 * 64) >> (i % 64) & 1) != 0, found != model.end());
  }
  EXPECT_GE(array.memory_bytes(), model.size() * 8);
  EXPECT_LE(array.memory_bytes(), (kElements / 1024 + 1) * 200 + model.size() * 8);
}

INSTANTIATE_TEST_SUITE_P(Counts, SparseArrays, ::testing::Values(0, 1, 20, 300, 20000));

}  // namespace
}  // namespace intervale
