// Properties of fronts: the mesh depends only on the field, the range and which diamonds are split, whatever was shown
// before.
#include "common/front/front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/ivm/extraction.h"
#include "common/mesh/mesh_digest.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/front_laws.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using testing::broken_law;
using testing::handle_of;
using testing::has_naive_points;
using testing::on_threads;
using testing::ValueField;
using testing::wrong_value;

// The mesh of a data set of this range at full detail.
struct Expected {
  std::string digest;
  std::uint64_t updates = 0;
};
Expected expected(const ValueField& field, const Range& range, Refine refine) {
  const IntervalVolume sigma = testing::build(field.volume, {.range = range, .refine = refine});
  return {mesh_digest(extract(sigma, {})->front.mesh()), sigma.set().size()};
}

class FrontMeshes : public testing::FrontLaws {
 protected:
  // A front with all diamonds that can be split.
  [[nodiscard]] Front full(const Range& range, Refine refine, const ParallelFor& parallel = serial) const {
    Front front = field.front(range, refine);
    EXPECT_EQ(front.split_all(testing::groups_of(testing::all_centres(field)), testing::keys_of(field), parallel), std::nullopt);
    return front;
  }
  // Splits diamonds in random order, each as soon as it can be.
  void split_in_random_order(Front& front, std::vector<Vertex> waiting) {
    while (!waiting.empty()) {
      std::shuffle(waiting.begin(), waiting.end(), random);
      std::vector<Vertex> later;
      for (const Vertex c : waiting) {
        if (const auto handle = front.find(c)) {
          front.split(*handle, field.key(c));
        } else {
          later.push_back(c);
        }
      }
      ASSERT_LT(later.size(), waiting.size()) << "nothing can be split";
      waiting = later;
    }
  }
  void expect_mesh_of(const Front& front, const Range& range, Refine refine) {
    SCOPED_TRACE(testing::text_of(range, refine));
    const Expected right = expected(field, range, refine);
    EXPECT_EQ(front.validate(), std::nullopt);
    EXPECT_EQ(front.shown_count(), right.updates);
    const Mesh mesh = front.mesh();
    EXPECT_EQ(mesh.tets.size(), front.tet_count());
    EXPECT_EQ(mesh_digest(mesh), right.digest);
    EXPECT_EQ(wrong_value(front, field, mesh), "");
    EXPECT_TRUE(has_naive_points(front, field, mesh));
  }
};

TEST_P(FrontMeshes, RelevantSplitsInAnyOrderGiveTheSameMesh) {
  for (int trial = 0; trial < 4; ++trial) {
    const Range range = any_range();
    const Refine refine = any_refine();
    const FieldHierarchy delta(field.volume, {.range = range, .refine = refine});
    std::vector<Vertex> centres;
    delta.set().for_each_down([&](const Place& p) { centres.push_back(delta.set().centre(p)); });
    Front front = field.front(range, refine);
    split_in_random_order(front, centres);
    EXPECT_EQ(front.split_count(), centres.size());
    expect_mesh_of(front, range, refine);
  }
}

TEST_P(FrontMeshes, AllSplitsInAnyOrderShowWhatIsRelevant) {
  const Range range = any_range();
  const Refine refine = any_refine();
  Front front = field.front(range, refine);
  split_in_random_order(front, testing::all_centres(field));
  expect_mesh_of(front, range, refine);
  const Front at_once = full(range, refine);
  EXPECT_EQ(at_once.split_count(), front.split_count());
  EXPECT_TRUE(at_once.is_part_of(front));
  EXPECT_TRUE(front.is_part_of(at_once));
  expect_mesh_of(at_once, range, refine);
}

TEST_P(FrontMeshes, AnyRangeHasTheMeshOfAFreshFront) {
  Front front = full({0, 0}, Refine::boundary, on_threads);
  for (int trial = 0; trial < 8; ++trial) {
    const Range range = any_range();
    const Refine refine = any_refine();
    const std::uint64_t generation = front.state().point_generation;
    front.set_range(range, refine, ~std::uint64_t(0), trial % 2 == 0 ? ParallelFor(serial) : on_threads);
    EXPECT_EQ(front.range(), range);
    EXPECT_EQ(front.refine(), refine);
    EXPECT_GT(front.state().point_generation, generation);
    EXPECT_EQ(front.withheld_count(), 0u);
    expect_mesh_of(front, range, refine);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, FrontMeshes, testing::seeds(1, 40));

class FrontBudgets : public FrontMeshes {};

// Never more than the budget; what it hid can be shown one by one, and then the mesh is whole.
TEST_P(FrontBudgets, SplitsStayHiddenUntilThereIsRoom) {
  const Range range = any_range();
  const Refine refine = any_refine();
  const Front whole = full(range, refine);
  Front front = field.front(range, refine);
  const std::uint64_t most = std::max(front.tet_count(), random() % (whole.tet_count() + 1));
  const std::vector<Vertex> centres = testing::all_centres(field);
  FrontCursor cursor(front.state());
  std::uint64_t step = 0;
  for (const Vertex c : centres) {
    cursor.move_to(Diamond(c));
    ASSERT_TRUE(cursor.find(handle_of(c).slot));
    front.split(cursor, field.key(c), most);
    ASSERT_LE(front.tet_count(), most);
    if (++step % 200 == 0) {
      ASSERT_EQ(front.validate(), std::nullopt);
    }
  }
  ASSERT_EQ(front.validate(), std::nullopt);
  EXPECT_EQ(front.split_count(), whole.split_count());
  EXPECT_EQ(broken_law(front.mesh(), field.volume.grid, range.alpha == range.beta), "");
  EXPECT_TRUE(has_naive_points(front, field, front.mesh()));
  for (const Vertex c : centres) {
    const bool is_hidden = front.is_hidden(handle_of(c));
    EXPECT_TRUE(!front.show(handle_of(c), ~std::uint64_t(0)) || is_hidden);
  }
  EXPECT_EQ(front.withheld_count(), 0u);
  EXPECT_EQ(mesh_digest(front.mesh()), mesh_digest(whole.mesh()));
}

TEST_P(FrontBudgets, HoldForAnotherRange) {
  Front front = full(any_range(), any_refine());
  for (int trial = 0; trial < 4; ++trial) {
    const Range range = any_range();
    const Refine refine = any_refine();
    SCOPED_TRACE(testing::text_of(range, refine));
    front.set_range(range, refine);
    const std::uint64_t whole = front.tet_count(), coarsest = field.front(range, refine).tet_count();
    const std::uint64_t most = std::max(coarsest, random() % (whole + 2));
    front.set_range(range, refine, most);
    EXPECT_LE(front.tet_count(), most);
    EXPECT_EQ(front.withheld_count() == 0, front.tet_count() == whole);
    ASSERT_EQ(front.validate(), std::nullopt);
    EXPECT_EQ(broken_law(front.mesh(), field.volume.grid, range.alpha == range.beta), "");
    EXPECT_EQ(wrong_value(front, field, front.mesh()), "");
    front.set_range(range, refine, whole);
    expect_mesh_of(front, range, refine);
  }
}

INSTANTIATE_TEST_SUITE_P(Random, FrontBudgets, testing::seeds(1, 40));

// A box whose sides are no powers of two, of several supercubes along each axis.
TEST(Front, ALargeClampingBoxHasTheMeshOfAFreshFront) {
  for (const unsigned seed : {0u, 1u, 2u, 4u}) {
    const ValueField field = testing::random_value_field({17, 12, 33}, seed);
    std::mt19937 random(seed);
    Front front = field.front({0, 0}, Refine::boundary);
    ASSERT_EQ(front.split_all(testing::groups_of(testing::all_centres(field)), testing::keys_of(field), on_threads), std::nullopt);
    for (int trial = 0; trial < 4; ++trial) {
      const Range range = testing::random_range(field, random);
      const Refine refine = trial % 2 == 0 ? Refine::boundary : Refine::uniform;
      SCOPED_TRACE(testing::text_of(range, refine));
      front.set_range(range, refine, ~std::uint64_t(0), on_threads);
      const Expected right = expected(field, range, refine);
      const Mesh mesh = front.mesh();
      EXPECT_EQ(mesh_digest(mesh), right.digest);
      EXPECT_EQ(front.shown_count(), right.updates);
      EXPECT_EQ(wrong_value(front, field, mesh), "");
      EXPECT_TRUE(has_naive_points(front, field, mesh));
      EXPECT_EQ(front.validate(), std::nullopt);
    }
  }
}

TEST(Front, RefusesGroupsThatCannotBeSplit) {
  const ValueField field = testing::random_value_field({9, 7, 5}, 0);
  const std::vector<Vertex> all = testing::all_centres(field);
  const Front root = field.front({2, 5}, Refine::boundary);
  Front without_root = root, outside = root;
  EXPECT_EQ(without_root.split_all(testing::groups_of({all.begin() + 1, all.end()}), testing::keys_of(field)).has_value(), true);
  EXPECT_EQ(outside.split_all(testing::groups_of({all.front(), {8, 8, 12}}), testing::keys_of(field)), (Vertex{8, 8, 12}));
}

TEST(Front, ACoarserFrontIsPartOfAFinerOne) {
  const ValueField field = testing::random_value_field({9, 9, 9}, 1);
  const Range range{-0.3, 0.4};
  const std::vector<Vertex> all = testing::all_centres(field);
  Front fine = field.front(range, Refine::boundary), coarse = fine;
  ASSERT_EQ(fine.split_all(testing::groups_of(all), testing::keys_of(field)), std::nullopt);
  for (const Vertex c : all) {
    const auto handle = Diamond(c).scale > 0 ? coarse.find(c) : std::nullopt;
    if (handle) coarse.split(*handle, field.key(c));
  }
  EXPECT_TRUE(coarse.is_part_of(fine));
  EXPECT_FALSE(fine.is_part_of(coarse));
  Front other = coarse;
  other.set_range({-0.2, 0.4}, Refine::boundary);
  EXPECT_FALSE(other.is_part_of(fine));
  ASSERT_TRUE(fine.coarsen_to(coarse));
  EXPECT_EQ(fine.validate(), std::nullopt);
  EXPECT_EQ(mesh_digest(fine.mesh()), mesh_digest(coarse.mesh()));
}

TEST(Front, RefusesWhatCannotBeSplit) {
  const Front front = testing::value_field(testing::gyroid({9, 9, 9}), 0).front({-0.3, 0.2}, Refine::boundary);
  EXPECT_TRUE(front.find({4, 4, 4}));
  for (const Vertex v : {Vertex{0, 0, 0}, Vertex{8, 8, 8}, Vertex{2, 2, 2}, Vertex{-4, 4, 4}, Vertex{4, 4, 1 << 30}}) EXPECT_FALSE(front.find(v));
}

TEST(Front, TheBudgetIsNeverPassed) {
  const Volume volume = testing::gyroid({17, 17, 17});
  const IntervalVolume sigma = testing::build(volume, {.range = {-0.3, 0.2}});
  for (std::uint64_t most : {0u, 100u, 1000u, 5000u}) {
    Lod lod;
    lod.max_tets = most;
    const auto extracted = extract(sigma, lod);
    ASSERT_TRUE(extracted);
    EXPECT_LE(extracted->front.tet_count(), std::max<std::uint64_t>(most, root_front(sigma.description()).tet_count()));
    EXPECT_EQ(broken_law(extracted->front.mesh(), volume.grid), "");
    Lod updates;
    updates.max_updates = most;
    EXPECT_LE(extract(sigma, updates)->updates, most);
  }
}

}  // namespace
}  // namespace intervale
