// The keys at the vertices of diamonds: those that an interval volume gives, those of the samples, and those that a
// front gives.
#include "common/ivm/vertex_keys.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "common/diamond/split_set.h"
#include "common/ivm/extraction.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/fronts_by_cuts.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

class VertexKeysLaws : public ::testing::TestWithParam<unsigned> {
 protected:
  VertexKeysLaws() {
    const auto made =
        FieldHierarchy(field_.volume, {testing::random_range(field_, random_), GetParam() % 3 == 0 ? Refine::uniform : Refine::boundary})
            .compact(field_.format);
    EXPECT_TRUE(made) << made.error().message;
    volume_ = *made;
  }
  // Calls visit(supercube, slot) for the diamonds of the volume, and those that can be split after all of them; by
  // supercube, in the order of their keys or in any other.
  template <class Visit>
  void for_each_ready(bool in_order, Visit&& visit) {
    const SupercubeSet& set = volume_->set();
    const SplitSet all = testing::all_of(set);
    SplittableSlots splittable(set, volume_->domain(), all);
    std::vector<SupercubeKey> keys;
    for (BrickIndex b{0}; b < set.bricks().size(); ++b) {
      set.for_each_supercube(b, [&](SupercubeIndex, SupercubeKey key) { keys.push_back(key); });
    }
    if (!in_order) std::shuffle(keys.begin(), keys.end(), random_);
    for (const SupercubeKey key : keys) {
      splittable.move_to(key);
      for (const Slot slot : set_bits<Slot>(splittable.slots())) visit(key, slot);
    }
  }

  // The keys that a cursor gathers of the diamond that it found last.
  static void expect_equal(FrontCursor& cursor, const VertexKeys& keys) {
    VertexKeys gathered = cursor.vertex_keys();
    const int vertices = cursor.diamond().row->vertices;
    fill_missing(gathered, vertices);
    for (int v = 0; v < vertices; ++v) ASSERT_EQ(gathered[std::size_t(v)], keys[std::size_t(v)]) << "vertex " << v;
  }

  static constexpr std::array<std::array<std::int32_t, 3>, 6> kBoxes{{{9, 9, 9}, {9, 7, 5}, {17, 12, 13}, {6, 21, 4}, {2, 6, 3}, {30, 2, 11}}};
  testing::ValueField field_ = testing::random_value_field(kBoxes[GetParam() % kBoxes.size()], GetParam());
  std::mt19937 random_{GetParam()};
  Result<IntervalVolume> volume_ = fail("not made");
};

// The naive model: the sample at each vertex that exists; elsewhere the mean of the spine's ends.
TEST_P(VertexKeysLaws, AreTheKeysOfTheSamples) {
  for (const bool in_order : {true, false}) {
    SetNeighbours around(volume_->set());
    for_each_ready(in_order, [&](SupercubeKey key, Slot slot) {
      const Diamond d(centre_of(key, slot));
      const unsigned exist = Domain::vertices(*d.row, field_.domain.tets(d));
      ASSERT_EQ(exist & 3u, 3u) << "the ends of the spine";
      const auto mean = ValueKey((std::uint64_t(field_.key(d.vertex(0))) + field_.key(d.vertex(1))) / 2);
      VertexKeys keys{};
      around.move_to(key);
      gather_vertex_keys(*volume_, around, slot, keys);
      for (int v = 0; v < d.row->vertices; ++v) {
        ASSERT_EQ(keys[std::size_t(v)], (exist >> v & 1) != 0 ? field_.key(d.vertex(v)) : mean)
            << "vertex " << v << " of (" << d.centre.x << ", " << d.centre.y << ", " << d.centre.z << ")";
      }
    });
  }
}

TEST_P(VertexKeysLaws, AreThoseThatAFrontGathers) {
  const auto extraction = extract(*volume_, {});
  ASSERT_TRUE(extraction) << extraction.error().message;
  FrontCursor cursor(extraction->front.state());
  SetNeighbours around(volume_->set());
  for_each_ready(true, [&](SupercubeKey key, Slot slot) {
    VertexKeys keys{};
    around.move_to(key);
    gather_vertex_keys(*volume_, around, slot, keys);
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
TEST_P(VertexKeysLaws, AreThoseOfADiamondBeforeItsSplit) {
  Front front = root_front(volume_->description());
  FrontCursor cursor(front.state());
  SetNeighbours around(volume_->set());
  volume_->set().for_each_down([&](const Place& p) {
    VertexKeys keys{};
    around.move_to(p.key);
    gather_vertex_keys(*volume_, around, p.slot, keys);
    cursor.move_to(p.key);
    ASSERT_TRUE(cursor.find_unsplit(p.slot));
    expect_equal(cursor, keys);
    front.split(cursor, volume_->key(p.index));
  });
}

INSTANTIATE_TEST_SUITE_P(Random, VertexKeysLaws, ::testing::Range(0u, 30u));

}  // namespace
}  // namespace intervale
