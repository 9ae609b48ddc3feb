#include "common/util/index.h"

#include <gtest/gtest.h>

#include <array>
#include <type_traits>

#include "common/diamond/supercube.h"
#include "common/diamond/supercube_neighbours.h"

namespace intervale {
namespace {

template <class To, class... From>
constexpr bool kNoneMakes = (!std::is_constructible_v<To, From> && ...);

TEST(Index, OneKindDoesNotBecomeAnother) {
  static_assert(kNoneMakes<UpdateIndex, BrickIndex, SupercubeIndex, Slot>);
  static_assert(kNoneMakes<BrickIndex, UpdateIndex, SupercubeIndex, Slot>);
  static_assert(kNoneMakes<SupercubeIndex, UpdateIndex, BrickIndex, Slot>);
  static_assert(kNoneMakes<Slot, UpdateIndex, BrickIndex, SupercubeIndex>);
}

TEST(Index, AnIntegerBecomesOneOnlyExplicitly) {
  static_assert(std::is_constructible_v<UpdateIndex, int> && !std::is_convertible_v<int, UpdateIndex>);
  static_assert(std::is_constructible_v<UpdateIndex, std::size_t> && !std::is_convertible_v<std::size_t, UpdateIndex>);
  static_assert(kNoneMakes<UpdateIndex, double, void*>);
}

TEST(Index, BecomesAnIntegerImplicitly) {
  static_assert(std::is_convertible_v<BrickIndex, std::uint32_t> && std::is_convertible_v<UpdateIndex, std::size_t>);
  constexpr std::array<int, 3> values{5, 6, 7};
  static_assert(values[BrickIndex(2)] == 7 && 1u << BrickIndex(2) == 4);
}

// What assigns one is refused by -Wconversion; a cast, only by the type.
TEST(Index, BecomesNoIntegerOfFewerBits) {
  static_assert(!std::is_constructible_v<std::uint32_t, UpdateIndex> && !std::is_constructible_v<int, UpdateIndex>);
  static_assert(!std::is_constructible_v<std::uint16_t, BrickIndex> && !std::is_constructible_v<bool, BrickIndex>);
  static_assert(std::is_constructible_v<std::uint64_t, UpdateIndex> && std::is_constructible_v<std::size_t, BrickIndex>);
  static_assert(std::is_constructible_v<double, UpdateIndex>);
}

TEST(Index, CostsNoMoreThanItsInteger) {
  static_assert(sizeof(UpdateIndex) == sizeof(std::size_t) && alignof(UpdateIndex) == alignof(std::size_t));
  static_assert(sizeof(SupercubeIndex) == 4 && sizeof(BrickIndex) == 4);
  static_assert(sizeof(Slot) == 1 && sizeof(Link) == 2);
  static_assert(std::is_trivially_copyable_v<UpdateIndex> && std::is_trivially_destructible_v<UpdateIndex>);
}

TEST(Index, CountsUp) {
  UpdateIndex i;
  EXPECT_EQ(i, 0u);
  EXPECT_EQ(i++, 0u);
  EXPECT_EQ(++i, 2u);
  static_assert(std::is_same_v<decltype(i + 3), UpdateIndex>);
  EXPECT_EQ(i += 1, 3u);
  EXPECT_EQ(i + 3, 6u);
  static_assert(std::is_same_v<decltype(i - i), std::size_t>, "a difference is a count");
}

}  // namespace
}  // namespace intervale
