// Properties of fronts through any sequence of splits, merges, hides and shows: what is shown follows the rule, and the
// mesh depends on nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <set>
#include <vector>

#include "common/front/front.h"
#include "tests/support/front_laws.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/seeds.h"
#include "tests/support/value_fields.h"

namespace intervale {
namespace {

using testing::broken_law;
using testing::canonical;
using testing::handle_of;
using testing::has_naive_points;
using testing::ValueField;
using testing::wrong_value;

// What a front should show, from its splits alone.
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

class FrontSteps : public testing::FrontLaws {
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
    ASSERT_TRUE(has_naive_points(front, field, mesh));
    ASSERT_EQ(canonical(mesh), canonical(front_of(shown).mesh()));
  }
  // A front in which only these are split.
  [[nodiscard]] Front front_of(const Model::Centres& splits) const {
    Front some = field.front(front.range(), front.refine());
    for (const Vertex c : centres) {
      const auto handle = splits.contains(c) ? some.find(c) : std::nullopt;
      EXPECT_EQ(handle.has_value(), splits.contains(c)) << "the splits are not closed under parents";
      if (handle) some.split(*handle, field.key(c));
    }
    return some;
  }

 public:
  std::vector<Vertex> centres = testing::all_centres(field);
  Front front = field.front(any_range(), any_refine());
  Model model{field, front};
};

TEST_P(FrontSteps, KeepTheRuleAndTheMesh) {
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

TEST_P(FrontSteps, MergingIsTheInverseOfSplitting) {
  const testing::Canonical coarse = canonical(front.mesh());
  for (int i = 0; i < 400; ++i) step();
  expect_as_modelled();
  for (auto c = centres.rbegin(); c != centres.rend(); ++c) EXPECT_EQ(front.merge(*c), model.split.contains(*c));
  EXPECT_EQ(front.validate(), std::nullopt);
  EXPECT_EQ(front.split_count(), 0u);
  EXPECT_EQ(front.shown_count(), 0u);
  EXPECT_EQ(front.withheld_count(), 0u);
  EXPECT_EQ(canonical(front.mesh()), coarse);
}

// What is hidden is no part of the mesh; what comes back is as it was.
TEST_P(FrontSteps, HidingIsLeavingOut) {
  for (const Vertex c : centres) {
    front.split(handle_of(c), field.key(c));
    model.split.insert(c);
  }
  const testing::Canonical full = canonical(front.mesh());
  for (int i = 0; i < 200; ++i) {
    const Vertex c = centres[random() % centres.size()];
    if (front.hide(handle_of(c))) model.withheld.insert(c);
    ASSERT_EQ(front.is_hidden(handle_of(c)), !model.shown().contains(c));
  }
  expect_as_modelled();
  for (const Vertex c : centres) {
    if (random() % 4 != 0) continue;
    const std::uint64_t before = front.tet_count();  // no more than it had
    const bool fits = front.show(handle_of(c), before);
    ASSERT_LE(front.tet_count(), before);
    if (fits) {
      ASSERT_FALSE(front.is_hidden(handle_of(c)));
    }
  }
  ASSERT_EQ(front.validate(), std::nullopt);
  for (const Vertex c : centres) (void)front.show(handle_of(c), ~std::uint64_t(0));
  EXPECT_EQ(front.withheld_count(), 0u);
  EXPECT_EQ(canonical(front.mesh()), full);
}

INSTANTIATE_TEST_SUITE_P(Random, FrontSteps, testing::seeds(1, 40));

}  // namespace
}  // namespace intervale
