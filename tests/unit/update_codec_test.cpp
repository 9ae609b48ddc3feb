// Batches of updates: what one side encodes, the other applies; and bytes that are no batch.
#include "common/front/batch_decoder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <random>
#include <set>

#include "common/codec/batch.h"
#include "common/codec/split_names.h"
#include "common/ivm/extraction.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/batches.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/special_values.h"

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

Front root_of(const IntervalVolume& v) { return root_front(v.description()); }

std::vector<UpdateIndex> queue_of(const IntervalVolume& v, const Lod& lod = {}) { return in_order(v, select(v, lod), lod); }

// The front after the first n updates of the queue.
Front after(const IntervalVolume& v, std::size_t n) {
  Front front = root_of(v);
  const auto queue = queue_of(v);
  const auto applied = testing::apply_to(front, v.description(), batch_of(v, std::span(queue).first(n)));
  EXPECT_TRUE(applied && *applied == n);
  return front;
}

// In a buffer of exactly its size, so that the address sanitizer sees every step beyond.
Result<std::uint64_t> apply_exact(Front& front, const IntervalVolume& v, std::span<const std::uint8_t> bytes,
                                  std::uint64_t max_tets = ~std::uint64_t(0)) {
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  return testing::apply_to(front, v.description(), {exact.get(), bytes.size()}, max_tets);
}

// All updates, those of an error, and those of a box.
std::vector<Lod> lods_of(const IntervalVolume& v) {
  std::vector<Lod> lods(4);
  lods[1].error_percent = 10;
  lods[2].error_percent = 40;
  const auto& dims = v.description().grid.dims;
  lods[3].roi = Box{{0, 0, 0}, {dims[0] / 3.0, dims[1] / 2.0, dims[2] / 3.0}};
  return lods;
}

TEST(UpdateCodec, AnySplitIntoBatchesGivesTheExtractedMesh) {
  for (const IntervalVolume& v : volumes()) {
    for (const Lod& lod : lods_of(v)) {
      const auto extracted = extract(v, lod);
      ASSERT_TRUE(extracted);
      const auto expected = canonical(extracted->front.mesh());
      const auto queue = queue_of(v, lod);
      for (unsigned seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        std::mt19937 random(seed);
        const std::size_t most = seed == 0 ? 1 : seed == 1 ? queue.size() : 1 + random() % 200;
        Front front = root_of(v);
        for (std::size_t i = 0, n = 0; i < queue.size(); i += n) {
          n = std::min(queue.size() - i, seed < 2 ? most : 1 + random() % most);
          const auto applied = apply_exact(front, v, batch_of(v, std::span(queue).subspan(i, n), std::span(queue).first(i)));
          ASSERT_TRUE(applied) << applied.error().message;
          ASSERT_EQ(*applied, n);
          ASSERT_EQ(front.withheld_count(), 0u);
        }
        EXPECT_EQ(front.validate(), std::nullopt);
        EXPECT_EQ(front.split_count(), queue.size());
        EXPECT_EQ(front.shown_count(), extracted->updates);
        EXPECT_EQ(canonical(front.mesh()), expected);
      }
    }
  }
}

TEST(UpdateCodec, ABatchOfNothingChangesNothing) {
  const IntervalVolume v = testing::build(testing::gyroid({9, 9, 9}), {.range = {-0.3, 0.2}});
  Front front = root_of(v);
  const auto before = canonical(front.mesh());
  const auto applied = apply_exact(front, v, batch_of(v, {}));
  ASSERT_TRUE(applied) << applied.error().message;
  EXPECT_EQ(*applied, 0u);
  EXPECT_EQ(canonical(front.mesh()), before);
}

// What is missing reads as zeros. A session knows how many updates there are to be.
TEST(UpdateCodec, EveryTruncationIsRefusedOrHasAnotherNumberOfUpdates) {
  for (const IntervalVolume& v : volumes()) {
    const auto queue = queue_of(v);
    const std::size_t updates = std::min<std::size_t>(queue.size(), 300);
    const Bytes bytes = batch_of(v, std::span(queue).first(updates));
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      Front front = root_of(v);
      const auto applied = apply_exact(front, v, std::span(bytes).first(n));
      ASSERT_NE(applied.value_or(0), updates) << "the first " << n << " of " << bytes.size() << " bytes";
      ASSERT_EQ(front.validate(), std::nullopt);
    }
    Bytes longer = bytes;
    longer.push_back(0);
    Front front = root_of(v);
    EXPECT_FALSE(apply_exact(front, v, longer));
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
        const auto applied = apply_exact(front, v, damaged);
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
    if (apply_exact(front, v, bytes)) {
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
    EXPECT_FALSE(apply_exact(front, v, batch_of(v, std::span(queue).subspan(half / 2, half), std::span(queue).first(half / 2))))
        << "updates a second time";
    front = root_of(v);
    EXPECT_FALSE(apply_exact(front, v, batch_of(v, std::span(queue).subspan(1), std::span(queue).first(1)))) << "children without the root";
    front = root_of(v);
    EXPECT_FALSE(apply_exact(front, v, batch_of(v, std::span(queue).subspan(half), std::span(queue).first(half)))) << "children before parents";
    for (const IntervalVolume& other : all) {
      if (&other == &v) continue;
      front = root_of(v);
      EXPECT_FALSE(apply_exact(front, v, batch_of(other, queue_of(other)))) << "another volume's";
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
      const auto applied = apply_exact(front, v, bytes, most);
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

// What names of these updates take without models.
std::size_t names_bits(const IntervalVolume& v, const std::vector<UpdateIndex>& updates) {
  std::set<SupercubeKey> keys;
  for (const UpdateIndex i : updates) keys.insert(v.set().place(i).key);
  std::vector<SlotGroup> groups;
  groups.reserve(keys.size());
  for (const SupercubeKey key : keys) groups.push_back({{}, {}, key, 1});
  return plain_supercube_bits(groups);
}

// All diamonds are relevant, so every flag is that of an update.
TEST(UpdateCodec, ValuesWithoutAnyPatternTakeNoMoreThanTheirBits) {
  std::mt19937 random(11);
  std::vector<std::uint32_t> noise(17 * 17 * 17);
  for (std::uint32_t& sample : noise) sample = std::uint32_t(random() % 4294967295u);
  const Volume volume = testing::volume_of_type(SampleType::u32, {17, 17, 17}, noise);
  const IntervalVolume v = testing::build(volume, {.range = {-kInf, kInf}, .refine = Refine::uniform});
  const auto queue = queue_of(v);
  ASSERT_EQ(queue.size(), noise.size() - 8);
  for (const std::size_t n : {std::size_t(1), std::size_t(100), queue.size()}) {
    const Bytes batch = batch_of(v, std::span(queue).first(n));
    if (n == queue.size()) {
      EXPECT_EQ(RangeDecoder(batch).raw_bits(1), 1u) << "coded without models";
      EXPECT_LE(batch.size(), sizeof(std::uint64_t) + (n * 33 + names_bits(v, queue)) / 8 + 1);
    }
    Front front = root_of(v);
    const auto applied = apply_exact(front, v, batch);
    ASSERT_TRUE(applied) << applied.error().message;
    for (std::size_t i = 0; i < batch.size(); i += 1 + batch.size() / 200) {
      Front other = root_of(v);
      ASSERT_FALSE(apply_exact(other, v, std::span(batch).first(i))) << "the first " << i << " of " << batch.size() << " bytes";
    }
  }
  Front front = root_of(v);
  ASSERT_TRUE(apply_exact(front, v, batch_of(v, queue)));
  EXPECT_EQ(canonical(front.mesh()), canonical(extract(v, {})->front.mesh()));
}

// A batch of the root's supercube whose first update, the root's, is coded by `code(encoder, models, cursor, prediction)`.
template <class Code>
Bytes batch_of_root(const IntervalVolume& v, bool is_plain, Code code) {
  const Description& d = v.description();
  const Front front = root_of(v);
  const Diamond root(v.domain().root());
  FrontCursor cursor(front.state());
  cursor.move_to(root);
  EXPECT_TRUE(cursor.find(kSlotOfType[std::size_t(root.type)]));
  VertexKeys around = cursor.vertex_keys();
  fill_missing(around, root.row->vertices);
  const auto models = std::make_unique<BatchModels>(is_plain);
  RangeEncoder encoder;
  const SlotGroup group{{}, {}, supercube_key(root.scale, cursor.position()), 1};
  encoder.raw_bits(1, unsigned(is_plain));
  encode_supercubes(encoder, is_plain, {&group, 1});
  models->code_flag(encoder, 0, nearness(KeySides(d.format, d.range), d.refine, around, root.row->vertices), true);
  code(encoder, *models, predict_value(0, root.scale, around, d.weights, d.format.last), root.scale);
  for (int i = 0; i < 64; ++i) encoder.raw_bits(16, 0);  // what follows is never read
  return encoder.finish();
}

bool is_refused_for_its_value(const IntervalVolume& v, const Bytes& bytes) {
  Front front = root_of(v);
  const auto applied = apply_exact(front, v, bytes);
  return !applied && applied.error().message.find("a value is out of range") != std::string::npos;
}

TEST(UpdateCodec, AKeyBeyondTheLastIsRefused) {
  for (const IntervalVolume& v : volumes()) {
    const ValueKey last = v.description().format.last;
    const auto plain = [&](ValueKey key) {
      return batch_of_root(v, true, [&](RangeEncoder& encoder, BatchModels& models, const PredictedValue& predicted, int scale) {
        models.code_key(encoder, 0, scale, predicted, last, key);
      });
    };
    const auto most = ValueKey((std::uint64_t(1) << std::bit_width(last)) - 1);  // that its bits hold
    EXPECT_FALSE(is_refused_for_its_value(v, plain(0)));
    EXPECT_FALSE(is_refused_for_its_value(v, plain(last)));
    EXPECT_EQ(is_refused_for_its_value(v, plain(most)), most != last);
    if (most != last) {
      EXPECT_TRUE(is_refused_for_its_value(v, plain(last + 1)));
    }
    const auto modelled = [&](std::int64_t key) {
      return batch_of_root(v, false, [&](RangeEncoder& encoder, BatchModels& models, const PredictedValue& predicted, int scale) {
        models.values.of(0, scale, predicted.level).code(encoder, key - std::int64_t(predicted.key));
      });
    };
    for (const std::int64_t key : {std::int64_t(0), std::int64_t(last)}) EXPECT_FALSE(is_refused_for_its_value(v, modelled(key)));
    for (const std::int64_t key :
         {std::int64_t(last) + 1, std::int64_t(-1), std::int64_t(1) << 32, (std::int64_t(1) << 32) + 1, -(std::int64_t(1) << 32)})
      EXPECT_TRUE(is_refused_for_its_value(v, modelled(key))) << key;
  }
}

// By how many keys one of the values has to move to another side, tried one by one.
int naive_nearness(const KeySides& sides, Refine refine, const std::vector<ValueKey>& around) {
  const auto side = [&](std::int64_t n) { return int(n >= std::int64_t(sides.first_inside())) + int(n >= std::int64_t(sides.first_above())); };
  const int all = side(around[0]);
  for (const ValueKey key : around) {
    if (side(key) != all) return 0;
  }
  if (refine == Refine::uniform && all == int(Side::inside)) return 0;
  const auto leaves = [&](std::int64_t distance) {
    return std::any_of(around.begin(), around.end(), [&](ValueKey key) { return side(key - distance) != all || side(key + distance) != all; });
  };
  std::int64_t distance = 1;
  while (!leaves(distance)) ++distance;
  const auto [least, greatest] = std::minmax_element(around.begin(), around.end());
  const double share = 8.0 * double(distance) / (double(*greatest) - double(*least) + 1);
  return std::clamp(int(std::floor(std::log2(std::max(share, 0.5)))) + 1, 1, kNearness - 1);
}

TEST(Nearness, IsThatOfTheNaiveDefinition) {
  std::mt19937 random(3);
  std::array<int, kNearness> seen{};
  for (int trial = 0; trial < 20000; ++trial) {
    const ValueFormat format{SampleType::u16, 1, 0, ValueKey(random() % 400)};
    const int vertices = 4 + int(random() % 7);
    const ValueKey low = ValueKey(random() % (format.last + 1)), spread = ValueKey(1 + random() % (trial % 3 == 0 ? 4 : 60));
    VertexKeys around{};
    std::vector<ValueKey> keys;
    for (int v = 0; v < vertices; ++v) {
      around[std::size_t(v)] = std::min(format.last, ValueKey(low + random() % spread));
      keys.push_back(around[std::size_t(v)]);
    }
    for (std::size_t v = keys.size(); v < around.size(); ++v) around[v] = ValueKey(random() % 400);  // not to be looked at
    double alpha = int(random() % 440) - 20, beta = int(random() % 440) - 20;
    if (alpha > beta) std::swap(alpha, beta);
    const KeySides sides(format, {alpha, beta});
    for (const Refine refine : {Refine::boundary, Refine::uniform}) {
      const int near = nearness(sides, refine, around, vertices);
      ASSERT_EQ(near, naive_nearness(sides, refine, keys)) << "trial " << trial << ", [" << alpha << ", " << beta << "]";
      ++seen[std::size_t(near)];
    }
  }
  for (const int count : seen) EXPECT_GT(count, 100);
}

TEST(Nearness, OfSeveralRangesIsThatOfTheNearest) {
  std::mt19937 random(4);
  const ValueFormat format{SampleType::u16, 1, 0, 400};
  for (int trial = 0; trial < 5000; ++trial) {
    const ValueKey low = ValueKey(random() % 380), high = low + ValueKey(random() % 20);
    KeySpan span{low, low};
    span.add(high);
    ShownRanges shown;
    int nearest = kNearness;
    for (unsigned i = 0; i <= random() % kMaxRanges; ++i) {
      const double alpha = int(random() % 440) - 20;
      shown.push_back({{alpha, alpha + double(random() % 100)}, Refine(random() % 2)});
      nearest = std::min(nearest, naive_nearness(KeySides(format, shown.back().range), shown.back().refine, {low, high}));
    }
    ASSERT_EQ(FlagRanges(format, shown).nearness(span), nearest) << "trial " << trial;
    std::shuffle(shown.begin(), shown.end(), random);
    shown.push_back(shown.front());
    ASSERT_EQ(FlagRanges(format, shown).nearness(span), nearest) << "trial " << trial;
  }
}

TEST(Nearness, HoldsAtTheBordersOfTheKeys) {
  const ValueKey last = ~ValueKey(0) - 1;
  const ValueFormat format{SampleType::u32, 1, 0, last};
  const auto near = [&](const Range& range, ValueKey a, ValueKey b) {
    VertexKeys around{};
    around.fill(a);
    around[1] = b;
    return nearness(KeySides(format, range), Refine::boundary, around, 6);
  };
  const Range none{5e9, 6e9}, all{-kInf, kInf}, negative{-2, -1};
  EXPECT_EQ(near(none, last, last), 4) << "one key off, of one";  // 8 has four bits
  EXPECT_EQ(near(none, 0, 0), kNearness - 1);
  EXPECT_EQ(near(none, 0, last), 1) << "they differ by 2^32";
  EXPECT_EQ(near(negative, 0, 0), 4);
  EXPECT_EQ(near(negative, last, last), kNearness - 1);
  EXPECT_EQ(near(negative, 0, last), 1);
  EXPECT_EQ(near(all, 0, last), 1);
  EXPECT_EQ(near(all, 1000, 1000), kNearness - 1);
  EXPECT_EQ(near({double(last), kInf}, last - 1, last), 0);
  EXPECT_EQ(near({double(last), kInf}, last - 1, last - 1), 4);
  EXPECT_EQ(near({0, 0}, 0, 0), 4);
  EXPECT_EQ(near({0, 0}, 0, 1), 0);
  EXPECT_EQ(near({0, 0}, 1, 1), 4);
}

}  // namespace
}  // namespace intervale
