// Properties of fronts that are split by values: for any range the mesh is that of the field's hierarchy, whatever was
// shown before.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <thread>

#include "common/ivm/extraction.h"
#include "common/mesh/mesh_digest.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using testing::broken_law;
using testing::ValueField;

// On several threads, last piece first.
void on_threads(std::size_t count, const std::function<void(std::size_t)>& piece) {
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      for (std::size_t i = count; i-- > 0;) {
        if (i % 3 == t) piece(i);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// The mesh of the field's own hierarchy at full detail, made by cuts.
struct Expected {
  std::string digest;
  std::uint64_t updates = 0;
};
Expected expected(const ValueField& field, const Range& range, Refine refine) {
  const IntervalVolume sigma = testing::build(field.volume, {.range = range, .refine = refine});
  return {mesh_digest(extract(sigma, {})->front.mesh()), sigma.set().size()};
}

// The first point whose value is wrong, or an empty text.
std::string wrong_value(const Front& front, const ValueField& field, const Mesh& mesh) {
  if (mesh.value.size() != mesh.points.size()) return "not one value a point";
  const Grid& grid = field.volume.grid;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    if (mesh.surface[i] == Surface::alpha && mesh.value[i] != front.range().alpha) return "a value on alpha is not alpha";
    if (mesh.surface[i] == Surface::beta && mesh.value[i] != front.range().beta) return "a value on beta is not beta";
    if (mesh.surface[i] != Surface::inside) continue;
    std::array<std::int32_t, 3> at{};
    for (std::size_t k = 0; k < 3; ++k) at[k] = std::int32_t(std::lround((mesh.points[i][k] - grid.origin[k]) / grid.spacing[k]));
    if (mesh.value[i] != field.value({at[0], at[1], at[2]})) return "a value is not its sample's";
    if (side_of(mesh.value[i], front.range()) != Side::inside) return "a value is not within the range";
  }
  return {};
}

std::array<std::int32_t, 3> random_dims(unsigned seed) {
  std::mt19937 random(seed);
  const auto side = [&] { return std::int32_t(2 + random() % 9); };
  switch (seed % 4) {
    case 0:
      return {9, 9, 9};
    case 1:
      return {9, 7, 5};
    default:
      return {side(), side(), side()};
  }
}

class ValueFront : public ::testing::TestWithParam<unsigned> {
 protected:
  [[nodiscard]] Range any_range() { return testing::random_range(field, random); }
  [[nodiscard]] Refine any_refine() { return random() % 2 == 0 ? Refine::uniform : Refine::boundary; }
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
  }

 public:
  ValueField field = testing::random_value_field(random_dims(GetParam()), GetParam());
  std::mt19937 random{GetParam()};
};

TEST_P(ValueFront, RelevantSplitsInAnyOrderGiveTheMeshOfTheCuts) {
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

TEST_P(ValueFront, AllSplitsInAnyOrderShowWhatIsRelevant) {
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

TEST_P(ValueFront, AnyRangeHasTheMeshOfAFreshFront) {
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

INSTANTIATE_TEST_SUITE_P(Random, ValueFront, ::testing::Range(1u, 41u));

// What a front split by values should show, from its splits alone.
class Model {
 public:
  Model(const ValueField& field, const Front& front) : field_(field), front_(front) {}

  [[nodiscard]] bool counts(Vertex c) const {
    const Diamond d(c);
    const unsigned vertices = Domain::vertices(*d.row, field_.domain.tets(d));
    std::array<bool, 3> has{};
    has[std::size_t(side_of(field_.value(c), front_.range()))] = true;
    for (const int v : set_bits(vertices)) has[std::size_t(side_of(field_.value(d.vertex(v)), front_.range()))] = true;
    const int sides = has[0] + has[1] + has[2];
    return sides > 1 || (front_.refine() == Refine::uniform && has[1]);
  }

  struct Less {
    bool operator()(Vertex a, Vertex b) const { return std::array{a.x, a.y, a.z} < std::array{b.x, b.y, b.z}; }
  };
  using Centres = std::set<Vertex, Less>;
  Centres split, withheld;

  void add_with_ancestors(Vertex c, Centres& to) const {
    if (!split.contains(c) || !to.insert(c).second) return;
    const Diamond d(c);
    for (int k = 0; k < d.row->parents; ++k) add_with_ancestors(d.parent(k), to);
  }
  [[nodiscard]] Centres shown() const {
    Centres some;
    for (const Vertex c : split) {
      if (counts(c) && !withheld.contains(c)) add_with_ancestors(c, some);
    }
    return some;
  }

 private:
  const ValueField& field_;
  const Front& front_;
};

Front::Handle handle_of(Vertex c) {
  const Diamond d(c);
  const int up = d.scale + 2;
  return {supercube_key(d.scale, {c.x >> up, c.y >> up, c.z >> up}), kSlotOfType[d.type]};
}

class ValueFrontSteps : public ValueFront {
 protected:
  void step() {
    const Vertex c = centres[random() % centres.size()];
    const Front::Handle handle = handle_of(c);
    const bool was_shown = model.shown().contains(c);
    switch (random() % 8) {
      case 0:
        if (front.merge(c)) {
          EXPECT_EQ(model.split.erase(c), 1u);
          model.withheld.erase(c);
        }
        break;
      case 1:
        if (front.hide(handle)) {
          EXPECT_TRUE(was_shown && model.counts(c));
          model.withheld.insert(c);
        }
        break;
      case 2: {
        const bool may = model.split.contains(c) && !was_shown && model.counts(c);
        EXPECT_EQ(front.show(handle, ~std::uint64_t(0)), may);
        Model::Centres family;
        if (may) model.add_with_ancestors(c, family);
        for (const Vertex v : family) model.withheld.erase(v);
        break;
      }
      default:
        if (const auto found = front.find(c)) {
          const bool is_complete = model.withheld.empty();
          front.split(*found, field.key(c));
          EXPECT_TRUE(model.split.insert(c).second);
          if (!is_complete && model.counts(c)) model.withheld.insert(c);
        }
    }
  }
  void forget_some() {
    std::vector<Vertex> some;
    for (const Vertex c : model.split) {
      if (random() % 4 == 0) some.push_back(c);
    }
    front.forget(testing::groups_of(some));
    for (const Vertex c : some) {
      const auto slots = front.state().find_block(Diamond(c).scale, position_of_key(handle_of(c).supercube));
      if (slots != nullptr && slots->is_split(handle_of(c).slot)) continue;
      model.split.erase(c);
      model.withheld.erase(c);
    }
  }
  void expect_as_modelled() {
    ASSERT_EQ(front.validate(), std::nullopt);
    const Model::Centres shown = model.shown();
    ASSERT_EQ(front.split_count(), model.split.size());
    ASSERT_EQ(front.shown_count(), shown.size());
    ASSERT_EQ(front.withheld_count(),
              std::uint64_t(std::count_if(model.withheld.begin(), model.withheld.end(), [&](Vertex c) { return !shown.contains(c); })));
    for (const Vertex c : shown) ASSERT_TRUE(front.shown_slots(handle_of(c).supercube) >> handle_of(c).slot & 1);
    const Mesh mesh = front.mesh();
    ASSERT_EQ(mesh.tets.size(), front.tet_count());
    ASSERT_EQ(broken_law(mesh, field.volume.grid, front.range().alpha == front.range().beta), "");
    ASSERT_EQ(wrong_value(front, field, mesh), "");
  }

 public:
  std::vector<Vertex> centres = testing::all_centres(field);
  Front front = field.front(any_range(), any_refine());
  Model model{field, front};
};

TEST_P(ValueFrontSteps, KeepTheRuleAndTheMesh) {
  for (int round = 0; round < 10; ++round) {
    for (int i = 0; i < 60; ++i) step();
    expect_as_modelled();
    if (round % 3 == 1) {
      const Range range = any_range();
      front.set_range(range, any_refine());
      model.withheld.clear();
      expect_as_modelled();
    } else if (round % 5 == 3) {
      forget_some();
      expect_as_modelled();
    }
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Random, ValueFrontSteps, ::testing::Range(1u, 41u));

class ValueFrontBudgets : public ValueFront {};

// Never more than the budget; what it hid can be shown one by one, and then the mesh is whole.
TEST_P(ValueFrontBudgets, SplitsStayHiddenUntilThereIsRoom) {
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
  for (const Vertex c : centres) {
    const bool is_hidden = front.is_hidden(handle_of(c));
    EXPECT_TRUE(!front.show(handle_of(c), ~std::uint64_t(0)) || is_hidden);
  }
  EXPECT_EQ(front.withheld_count(), 0u);
  EXPECT_EQ(mesh_digest(front.mesh()), mesh_digest(whole.mesh()));
}

TEST_P(ValueFrontBudgets, HoldForAnotherRange) {
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

INSTANTIATE_TEST_SUITE_P(Random, ValueFrontBudgets, ::testing::Range(1u, 41u));

// A box whose sides are no powers of two, of several supercubes along each axis.
TEST(ValueFront, ALargeClampingBoxHasTheMeshOfTheCuts) {
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
      EXPECT_EQ(front.validate(), std::nullopt);
    }
  }
}

TEST(ValueFront, RefusesGroupsThatCannotBeSplit) {
  const ValueField field = testing::random_value_field({9, 7, 5}, 0);
  const std::vector<Vertex> all = testing::all_centres(field);
  const Front root = field.front({2, 5}, Refine::boundary);
  Front without_root = root, outside = root;
  EXPECT_EQ(without_root.split_all(testing::groups_of({all.begin() + 1, all.end()}), testing::keys_of(field)).has_value(), true);
  EXPECT_EQ(outside.split_all(testing::groups_of({all.front(), {8, 8, 12}}), testing::keys_of(field)), (Vertex{8, 8, 12}));
}

TEST(ValueFront, ACoarserFrontIsPartOfAFinerOne) {
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

}  // namespace
}  // namespace intervale
