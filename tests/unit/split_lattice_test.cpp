// What a server knows of a client's mesh around a supercube, against the samples, and against the front of a client.
#include "common/ivm/split_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/ivm/refinement.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/split_sets.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class SplitLattices : public ::testing::TestWithParam<unsigned> {
 protected:
  // Calls visit(supercube, slot) for the diamonds of the volume, and those that can be split after all of them; by
  // supercube, in the order of their keys or in any other. The lattice, at that supercube, has all of them as split.
  template <class Visit>
  void for_each_ready(bool in_order, Visit&& visit) {
    const SupercubeSet& set = volume_->set();
    std::vector<SupercubeKey> keys;
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey key) { keys.push_back(key); });
    }
    if (!in_order) std::shuffle(keys.begin(), keys.end(), random_);
    for (const SupercubeKey key : keys) {
      lattice_.move_to(key);
      for (const Slot slot : set_bits<Slot>(lattice_.splittable(kAllSlots))) visit(key, slot);
    }
  }

  // The keys of a diamond's vertices, whose span must be right.
  static VertexKeys gathered(const SplitLattice& lattice, Slot slot) {
    const int cls = class_of_slot(slot);
    VertexKeys keys{};
    const KeySpan span = cls == 0 ? lattice.gather<0>(slot, keys) : cls == 1 ? lattice.gather<1>(slot, keys) : lattice.gather<2>(slot, keys);
    const auto [least, greatest] = std::minmax_element(keys.begin(), keys.begin() + diamond_type(kTypeOfSlot[slot]).vertices);
    EXPECT_EQ(span.least, *least);
    EXPECT_EQ(span.greatest, *greatest);
    return keys;
  }

  // The keys of a diamond's vertices are those of the naive model: the sample at each vertex that exists; elsewhere the
  // mean of the spine's ends.
  void expect_samples(const SplitLattice& lattice, SupercubeKey key, Slot slot) {
    const Diamond d(centre_of(key, slot));
    const unsigned exist = Domain::vertices(*d.row, field_.domain.tets(d));
    ASSERT_EQ(exist & 3u, 3u) << "the ends of the spine";
    const auto mean = ValueKey((std::uint64_t(field_.key(d.vertex(0))) + field_.key(d.vertex(1))) / 2);
    const VertexKeys keys = gathered(lattice, slot);
    for (int v = 0; v < d.row->vertices; ++v) {
      ASSERT_EQ(keys[std::size_t(v)], (exist >> v & 1) != 0 ? field_.key(d.vertex(v)) : mean)
          << "vertex " << v << " of (" << d.centre.x << ", " << d.centre.y << ", " << d.centre.z << ")";
    }
  }

  // The keys that a cursor gathers of the diamond that it found last.
  static void expect_equal(FrontCursor& cursor, const VertexKeys& keys) {
    VertexKeys gathered = cursor.vertex_keys();
    const int vertices = cursor.diamond().row->vertices;
    fill_missing(gathered, vertices);
    for (int v = 0; v < vertices; ++v) ASSERT_EQ(gathered[std::size_t(v)], keys[std::size_t(v)]) << "vertex " << v;
  }

  static constexpr std::uint64_t kAllSlots = (std::uint64_t(1) << kSlots) - 1;
  static constexpr std::array<std::array<std::int32_t, 3>, 6> kBoxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}, {2, 6, 3}, {30, 2, 11}}};
  testing::ValueField field_ = testing::random_value_field(kBoxes[GetParam() % kBoxes.size()], GetParam());
  std::mt19937 random_{GetParam()};
  const Result<IntervalVolume> volume_ =
      FieldHierarchy(field_.volume, {testing::random_range(field_, random_), GetParam() % 3 == 0 ? Refine::uniform : Refine::boundary})
          .compact(field_.format);
  const SplitSet all_ = testing::all_of(volume_->set());
  SplitLattice lattice_{*volume_, all_};
};

TEST_P(SplitLattices, KeysAreThoseOfTheSamples) {
  for (const bool in_order : {true, false}) {
    for_each_ready(in_order, [&](SupercubeKey key, Slot slot) { expect_samples(lattice_, key, slot); });
  }
}

// Split ones count as ready too: what is not split and ready is what the front can split.
TEST_P(SplitLattices, ReadyIsWhatAFrontCanSplit) {
  const SupercubeSet& set = volume_->set();
  for (const double share : {0.0, 0.01, 0.1, 0.6}) {
    std::bernoulli_distribution wanted(share);
    const SplitSet split = select(set, [&](const Place&) { return wanted(random_); });
    Front front = root_front(volume_->description());
    set.for_each_down([&](const Place& p) {
      if (!split.contains(p)) return;
      const auto handle = front.find(SupercubeSet::centre(p));
      ASSERT_TRUE(handle);
      front.split(*handle, volume_->key(p.index));
    });
    SplitLattice lattice(*volume_, split);
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex s, SupercubeKey key) {
        lattice.move_to(key);
        const std::uint64_t ready = lattice.splittable(kAllSlots), is_split = split.slots(b, key);
        ASSERT_EQ(is_split & ~ready, 0u) << "the ancestors of what is split are split";
        ASSERT_EQ(lattice.splittable(~is_split & kAllSlots), ready & ~is_split);
        lattice.move_to(SlotGroup{b, s, key, 0});
        ASSERT_EQ(lattice.splittable(kAllSlots), ready) << "the same without a lookup";
        for (Slot slot{0}; slot < kSlots; ++slot) {
          const bool can_be = front.find(centre_of(key, slot)).has_value();
          ASSERT_EQ(((ready & ~is_split) >> slot & 1) != 0, can_be) << "share " << share << ", slot " << slot;
          if ((ready >> slot & 1) != 0) expect_samples(lattice, key, slot);
        }
      });
    }
  }
}

TEST_P(SplitLattices, KeysAreThoseThatAFrontGathers) {
  const auto extraction = extract(*volume_, {});
  ASSERT_TRUE(extraction) << extraction.error().message;
  FrontCursor cursor(extraction->front.state());
  for_each_ready(true, [&](SupercubeKey key, Slot slot) {
    const VertexKeys keys = gathered(lattice_, slot);
    cursor.move_to(key);
    for (const bool at_once : {false, true}) {
      ASSERT_TRUE(at_once ? cursor.gather_keys(slot) : cursor.gather_sides(slot));
      expect_equal(cursor, keys);
    }
    if (cursor.is_split()) {
      const auto place = volume_->set().find(centre_of(key, slot));
      ASSERT_TRUE(place);
      ASSERT_EQ(cursor.centre_key(), volume_->key(place->index));
    }
  });
}

// As before its split: of a front with some splits.
TEST_P(SplitLattices, KeysAreThoseOfADiamondBeforeItsSplit) {
  Front front = root_front(volume_->description());
  FrontCursor cursor(front.state());
  volume_->set().for_each_down([&](const Place& p) {
    lattice_.move_to(p.key);
    ASSERT_EQ(lattice_.splittable(std::uint64_t(1) << p.slot), std::uint64_t(1) << p.slot);
    const VertexKeys keys = gathered(lattice_, p.slot);
    cursor.move_to(p.key);
    ASSERT_TRUE(cursor.find(p.slot));
    expect_equal(cursor, keys);
    front.split(cursor, volume_->key(p.index));
  });
}

INSTANTIATE_TEST_SUITE_P(Random, SplitLattices, ::testing::Range(0u, 30u));

}  // namespace
}  // namespace intervale
