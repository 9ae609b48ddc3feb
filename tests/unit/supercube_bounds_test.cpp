#include "common/selection/supercube_bounds.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "common/util/bits.h"

namespace intervale {
namespace {

constexpr std::size_t kBricks = 70;  // some pages, the last one not full

// By brick, by supercube.
using Kept = std::map<std::size_t, std::map<std::size_t, Highest>>;

std::size_t count_in(std::size_t brick) { return brick % 64 + 1; }  // supercubes

void expect_kept(const SupercubeBounds& bounds, const Kept& model) {
  constexpr Highest kOther{1, 2, 3, 4};
  for (std::size_t b = 0; b < kBricks; ++b) {
    SupercubeBounds::OfBrick read;
    read.highest.fill(kOther);
    bounds.read(BrickIndex(std::uint32_t(b)), read);
    const auto found = model.find(b);
    for (std::size_t n = 0; n < SupercubeBounds::kBrick; ++n) {
      const bool is_kept = found != model.end() && found->second.count(n) != 0;
      EXPECT_EQ(read.kept >> n & 1, std::uint64_t(is_kept)) << b << ", " << n;
      EXPECT_EQ(read.highest[n], is_kept ? found->second.at(n) : kOther) << b << ", " << n;
    }
  }
}

// Which bounds there are: error steps, distances and slopes up to these.
class SupercubeBoundsTest : public ::testing::TestWithParam<Highest> {};

TEST_P(SupercubeBoundsTest, AreThoseThatWereKeptLast) {
  std::mt19937 random(5);
  const auto up_to = [&](unsigned most) { return std::uint8_t(random() % (most + 1)); };
  const Highest most = GetParam();
  SupercubeBounds bounds(kBricks);
  Kept model;
  expect_kept(bounds, model);
  for (int trial = 0; trial < 400; ++trial) {
    const std::size_t b = random() % kBricks;
    auto& of_brick = model[b];
    for (std::size_t n = 0; n < 1 + random() % count_in(b); ++n) {
      of_brick[random() % count_in(b)] = {up_to(most.error_step), up_to(most.distance), up_to(most.slope), up_to(most.slope_below)};
    }
    SupercubeBounds::OfBrick write;
    for (const auto& [n, highest] : of_brick) {
      write.kept |= std::uint64_t(1) << n;
      write.highest[n] = highest;
    }
    bounds.write(BrickIndex(std::uint32_t(b)), write);
    if (trial % 40 == 0) expect_kept(bounds, model);
  }
  expect_kept(bounds, model);
}

// A bound takes no more bits than bounds of its brick differ in.
TEST_P(SupercubeBoundsTest, TakeMemoryForWhatDiffers) {
  std::mt19937 random(6);
  const auto up_to = [&](unsigned most) { return std::uint8_t(random() % (most + 1)); };
  const Highest most = GetParam();
  SupercubeBounds bounds(kBricks);
  std::size_t bits = 0;
  for (const std::uint8_t each : {most.error_step, most.distance, most.slope, most.slope_below}) bits += std::size_t(std::bit_width(unsigned(each)));
  const std::size_t empty = bounds.memory_bytes();
  EXPECT_LE(empty, (kBricks / 32 + 1) * 8);
  for (std::uint32_t b = 0; b < kBricks; ++b) {
    SupercubeBounds::OfBrick all;
    all.kept = ~std::uint64_t(0) >> (64 - count_in(b));
    for (Highest& h : all.highest) h = {up_to(most.error_step), up_to(most.distance), up_to(most.slope), up_to(most.slope_below)};
    const std::size_t before = bounds.memory_bytes();
    bounds.write(BrickIndex(b), all);
    EXPECT_LE(bounds.memory_bytes() - before, 41 + (count_in(b) + count_in(b) * bits) / 8) << b;
  }
}

INSTANTIATE_TEST_SUITE_P(Bounds, SupercubeBoundsTest,
                         ::testing::Values(Highest{0, 0, 0, 0}, Highest{200, 0, 15, 3}, Highest{255, 255, 15, 15}, Highest{3, 90, 13, 0}));

}  // namespace
}  // namespace intervale
