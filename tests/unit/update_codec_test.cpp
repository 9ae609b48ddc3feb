#include "common/front/batch_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "common/ivm/extraction.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/batches.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"

namespace intervale {
namespace {

using testing::batch_of;
using testing::broken_law;
using testing::canonical;

using Bytes = std::vector<std::uint8_t>;

std::vector<IntervalVolume> volumes() {
  const std::vector<std::array<std::int32_t, 3>> dims{{9, 9, 9}, {7, 4, 11}, {6, 10, 5}};
  std::vector<IntervalVolume> all;
  all.push_back(testing::build(testing::gyroid(dims[0]), {.range = {-0.3, 0.2}}));
  all.push_back(testing::build(testing::digits(dims[1], 3), {.range = {3, 5.5}}));
  all.push_back(testing::build(testing::bump(dims[2], 4), {.range = {80, 80}}));
  return all;
}

Front root_of(const IntervalVolume& v) { return Front(v.description().grid, *decode_root_patch(v.description().root_patch, v.domain())); }

std::vector<UpdateIndex> queue_of(const IntervalVolume& v) { return in_order(v, select(v, Lod{}), {}); }

// The front after the first n updates of the queue.
Front after(const IntervalVolume& v, std::size_t n) {
  Front front = root_of(v);
  const auto queue = queue_of(v);
  const auto applied = apply_batch(front, batch_of(v, std::span(queue).first(n)));
  EXPECT_TRUE(applied && *applied == n);
  return front;
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<std::uint64_t> apply_exact(Front& front, std::span<const std::uint8_t> bytes, std::uint64_t max_tets = ~std::uint64_t(0)) {
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  return apply_batch(front, {exact.get(), bytes.size()}, max_tets);
}

TEST(UpdateCodec, AnySplitIntoBatchesGivesTheExtractedMesh) {
  for (const IntervalVolume& v : volumes()) {
    const auto expected = canonical(extract(v, {})->front.mesh());
    const auto queue = queue_of(v);
    for (unsigned seed = 0; seed < 8; ++seed) {
      SCOPED_TRACE("seed " + std::to_string(seed));
      std::mt19937 random(seed);
      const std::size_t most = seed == 0 ? 1 : seed == 1 ? queue.size() : 1 + random() % 200;
      Front front = root_of(v);
      for (std::size_t i = 0, n = 0; i < queue.size(); i += n) {
        n = std::min(queue.size() - i, seed < 2 ? most : 1 + random() % most);
        const auto applied = apply_exact(front, batch_of(v, std::span(queue).subspan(i, n), std::span(queue).first(i)));
        ASSERT_TRUE(applied) << applied.error().message;
        ASSERT_EQ(*applied, n);
        ASSERT_EQ(front.shown_count(), front.split_count());
      }
      EXPECT_EQ(front.validate(), std::nullopt);
      EXPECT_EQ(canonical(front.mesh()), expected);
    }
  }
}

TEST(UpdateCodec, ABatchOfNothingChangesNothing) {
  const IntervalVolume v = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  Front front = root_of(v);
  const auto before = canonical(front.mesh());
  const auto applied = apply_exact(front, batch_of(v, {}));
  ASSERT_TRUE(applied) << applied.error().message;
  EXPECT_EQ(*applied, 0u);
  EXPECT_EQ(canonical(front.mesh()), before);
}

TEST(UpdateCodec, EveryTruncationIsRefused) {
  for (const IntervalVolume& v : volumes()) {
    const auto queue = queue_of(v);
    const Bytes bytes = batch_of(v, std::span(queue).first(std::min<std::size_t>(queue.size(), 300)));
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      Front front = root_of(v);
      ASSERT_FALSE(apply_exact(front, std::span(bytes).first(n))) << "the first " << n << " of " << bytes.size() << " bytes";
    }
    Bytes longer = bytes;
    longer.push_back(0);
    Front front = root_of(v);
    EXPECT_FALSE(apply_exact(front, longer));
  }
}

// Bytes have no checksum here (zstd and TCP stand before): a flip may be a batch like any other, never a broken front.
TEST(UpdateCodec, EveryFlippedByteFailsOrLeavesAFrontThatHolds) {
  for (const IntervalVolume& v : volumes()) {
    const auto queue = queue_of(v);
    const std::size_t start = queue.size() / 3, n = std::min<std::size_t>(queue.size() - start, 200);
    const Front stage = after(v, start);
    const Bytes bytes = batch_of(v, std::span(queue).subspan(start, n), std::span(queue).first(start));
    std::mt19937 random(7);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      for (const unsigned mask : {1u << random() % 8, 1 + unsigned(random() % 255), 0x80u}) {
        Bytes damaged = bytes;
        damaged[i] = std::uint8_t(damaged[i] ^ mask);
        Front front = stage;
        const auto applied = apply_exact(front, damaged);
        if (applied) {
          ASSERT_EQ(front.validate(), std::nullopt) << "byte " << i << ", mask " << mask;
        } else {
          EXPECT_FALSE(applied.error().message.empty());
        }
      }
    }
  }
}

TEST(UpdateCodec, GarbageIsRefused) {
  const IntervalVolume v = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  for (unsigned seed = 0; seed < 3000; ++seed) {
    std::mt19937 random(seed);
    Bytes bytes(random() % 300);
    const unsigned keep = seed % 3 == 0 ? 0xff : seed % 3 == 1 ? 0x03 : 0x11;
    for (auto& b : bytes) b = std::uint8_t(random() & keep);
    if (seed % 5 == 0)
      std::fill(bytes.begin(), bytes.begin() + std::min<std::ptrdiff_t>(12, std::ssize(bytes)), std::uint8_t(0xff));  // counts beyond all bounds
    Front front = root_of(v);
    if (apply_exact(front, bytes)) {
      EXPECT_EQ(front.validate(), std::nullopt) << "seed " << seed;
    }
  }
}

TEST(UpdateCodec, WhatDoesNotFitTheFrontIsRefused) {
  const auto all = volumes();
  for (const IntervalVolume& v : all) {
    const auto queue = queue_of(v);
    const std::size_t half = queue.size() / 2;
    Front front = after(v, half);
    EXPECT_FALSE(apply_exact(front, batch_of(v, std::span(queue).subspan(half / 2, half), std::span(queue).first(half / 2))))
        << "updates a second time";
    front = root_of(v);
    EXPECT_FALSE(apply_exact(front, batch_of(v, std::span(queue).subspan(1), std::span(queue).first(1)))) << "children without the root";
    front = root_of(v);
    EXPECT_FALSE(apply_exact(front, batch_of(v, std::span(queue).subspan(half), std::span(queue).first(half)))) << "children before parents";
    for (const IntervalVolume& other : all) {
      if (&other == &v) continue;
      front = root_of(v);
      EXPECT_FALSE(apply_exact(front, batch_of(other, queue_of(other)))) << "another volume's";
    }
  }
}

TEST(UpdateCodec, WhatDoesNotFitTheBudgetIsHidden) {
  for (const IntervalVolume& v : volumes()) {
    const auto queue = queue_of(v);
    const Bytes bytes = batch_of(v, queue);
    const std::uint64_t coarse = root_of(v).tet_count(), full = v.description().full.tets;
    std::uint64_t fewer = 0;
    for (std::uint64_t i = 0; i <= 40; ++i) {
      const std::uint64_t most = coarse + (full - coarse) * i / 40;
      Front front = root_of(v);
      const auto applied = apply_exact(front, bytes, most);
      ASSERT_TRUE(applied) << applied.error().message;
      EXPECT_LE(front.tet_count(), most);
      EXPECT_EQ(*applied, queue.size());
      EXPECT_EQ(front.split_count(), queue.size());
      EXPECT_GE(front.shown_count(), fewer) << "more budget, no fewer updates";
      fewer = front.shown_count();
      ASSERT_EQ(front.validate(), std::nullopt) << "at most " << most;
      ASSERT_EQ(broken_law(front.mesh(), v.description().grid, v.description().range.alpha == v.description().range.beta), "") << "at most " << most;
    }
  }
}

}  // namespace
}  // namespace intervale
