#include "common/util/sparse_array.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

namespace intervale {
namespace {

constexpr std::size_t kElements = 1500;  // some pages, the last one not full

// By number; what was used.
using Model = std::map<std::size_t, std::uint32_t>;

void expect_equal(const SparseArray<std::uint32_t>& array, const Model& model) {
  std::vector<std::uint32_t> used, expected;
  array.for_each([&used](std::uint32_t value) { used.push_back(value); });
  for (const auto& [i, value] : model) expected.push_back(value);
  EXPECT_EQ(used, expected);
  for (std::size_t i = 0; i < kElements; ++i) {
    const auto found = model.find(i);
    EXPECT_EQ(array.find(i), found == model.end() ? std::nullopt : std::optional(found->second));
    EXPECT_EQ(array.get(i), found == model.end() ? 0 : found->second);
  }
}

class SparseArrays : public ::testing::TestWithParam<std::size_t> {};  // how many elements are used, at most

TEST_P(SparseArrays, HoldWhatWasUsedAndNothingElse) {
  std::mt19937 random(7);
  SparseArray<std::uint32_t> array(kElements);
  Model model;
  for (std::size_t n = 0; n < GetParam(); ++n) {
    const std::size_t i = random() % kElements;
    const auto value = std::uint32_t(random());
    if (random() % 2 == 0) {
      array.set(i, value);
      model[i] = value;
    } else {
      array.update(i, [value](std::uint32_t had) { return had ^ value; });
      model[i] ^= value;
    }
  }
  expect_equal(array, model);
  const SparseArray<std::uint32_t> copy = array;
  array.update(random() % kElements, [](std::uint32_t had) { return had + 1; });
  expect_equal(copy, model);
  EXPECT_GE(copy.memory_bytes(), model.size() * 4);
  EXPECT_LE(copy.memory_bytes(), copy.size() / 256 * 76 + model.size() * 4);
}

TEST_P(SparseArrays, GiveTheirBitsFromAnywhere) {
  std::mt19937 random(11);
  SparseArray<std::uint32_t> array(kElements + 2);
  for (std::size_t n = 0; n < GetParam(); ++n) array.set(random() % kElements, std::uint32_t(random()));
  for (std::size_t i = 0; i < kElements; ++i) {
    for (const unsigned shift : {0u, 1u, 17u, 31u}) {
      std::uint64_t expected = 0;
      for (unsigned bit = 0; bit < 64; ++bit) expected |= std::uint64_t(array.get(i + (shift + bit) / 32) >> (shift + bit) % 32 & 1) << bit;
      EXPECT_EQ(array.bits(i, shift), expected) << i << " without the first " << shift;
    }
  }
}

TEST_P(SparseArrays, TellWhetherAnyOfSomeIsUsed) {
  std::mt19937 random(13);
  SparseArray<std::uint8_t> array(kElements);
  std::vector<bool> model(kElements);
  for (std::size_t n = 0; n < GetParam() / 8; ++n) {
    const std::size_t i = random() % kElements;
    array.set(i, 0);
    model[i] = true;
  }
  for (int trial = 0; trial < 1000; ++trial) {
    const std::size_t begin = random() % kElements, end = begin + random() % std::min<std::size_t>(kElements - begin + 1, 200);
    bool expected = false;
    for (std::size_t i = begin; i < end; ++i) expected = expected || model[i];
    EXPECT_EQ(array.uses_any(begin, end), expected) << begin << " to " << end;
    const std::uint64_t used = array.used(begin / 64 * 64);
    EXPECT_EQ((used >> (begin % 64) & 1) != 0, array.uses_any(begin, begin + 1)) << begin;
  }
}

INSTANTIATE_TEST_SUITE_P(Counts, SparseArrays, ::testing::Values(0, 1, 20, 300, 20000));

}  // namespace
}  // namespace intervale
