#include "common/codec/prediction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"

namespace intervale {
namespace {

// Calls visit(context, side of the centre, cuts) for every relevant diamond of some fields, borders included.
template <class Visit>
void for_each_diamond(Visit&& visit) {
  const auto all = [&](const Volume& volume, const Range& range) {
    const FieldHierarchy delta(volume, {.range = range});
    delta.set().for_each_down([&](const Place& p) {
      const Diamond d(delta.set().centre(p));
      visit(delta.context(d), delta.side(d.centre), delta.cuts(d));
    });
  };
  all(testing::gyroid({17, 13, 9}), {-0.3, 0.2});
  all(testing::digits({7, 9, 11}, 3), {3, 5.5});
  all(testing::bump({6, 10, 5}, 4), {80, 80});
}

// Cuts counted one edge at a time.
TEST(Prediction, CutsAreCountedByTheirSurfaces) {
  for_each_diamond([](const DiamondContext& c, Side, const std::vector<std::uint8_t>&) {
    for (const Side centre : {Side::below, Side::inside, Side::above}) {
      int all = 0;
      std::set<int> surfaces;
      for (int v = 0; v < c.row->vertices; ++v) {
        if (!c.has(v)) continue;
        all += cut_count(centre, c.side(v));
        if (alpha_cuts(centre, c.side(v))) surfaces.insert(0);
        if (beta_cuts(centre, c.side(v))) surfaces.insert(1);
      }
      EXPECT_EQ(c.count_cuts(centre).all, all);
      EXPECT_EQ(c.count_cuts(centre).first, int(surfaces.size()));
    }
  });
}

TEST(Prediction, ResidualsGiveBackTheCutsOfAField) {
  for_each_diamond([](const DiamondContext& c, Side centre, const std::vector<std::uint8_t>& cuts) {
    std::vector<std::uint8_t> residuals(cuts.size()), again(cuts.size());
    Prediction(c).encode(centre, cuts, residuals.data());
    Prediction(c).decode(centre, residuals, again.data());
    EXPECT_EQ(again, cuts);
  });
}

// Residuals may come from outside: whatever they are, and whatever a context holds, they are the residuals of the cuts
// that they give.
TEST(Prediction, AnyResidualsGiveCutsThatGiveThemBack) {
  std::mt19937 random(7);
  for (int round = 0; round < 20000; ++round) {
    DiamondContext c;
    static constexpr unsigned kTypes[3] = {21, 5, 1};
    c.row = &diamond_type(kTypes[round % 3]);
    c.vertices = (1u << c.row->vertices) - 1;
    if (round % 4 == 0) c.vertices &= unsigned(random()) | 3u;
    for (int v = 0; v < c.row->vertices; ++v) c.sides |= std::uint32_t(c.has(v) ? random() % 3 : 0) << (2 * v);
    for (int e = 0; e < c.row->edges; ++e) {
      const auto [a, b] = edge_ends(e, c.row->belt);
      if (!c.has(a) || !c.has(b)) continue;
      const auto place = [&] { return std::uint16_t(2 * (round % 5 == 0 ? random() % 2 * 255 : random() % 256) + 1); };
      if (alpha_cuts(c.side(a), c.side(b))) c.cut[e][0] = place();
      if (beta_cuts(c.side(a), c.side(b))) c.cut[e][1] = place();
    }
    const Side centre = Side(random() % 3);
    std::vector<std::uint8_t> residuals(std::size_t(c.count_cuts(centre).all)), cuts(residuals.size()), again(residuals.size());
    for (auto& d : residuals) d = std::uint8_t(random());
    Prediction(c).decode(centre, residuals, cuts.data());
    Prediction(c).encode(centre, cuts, again.data());
    EXPECT_EQ(again, residuals);
  }
}

// A field that is linear within every diamond is foretold up to the rounding of its cuts.
TEST(Prediction, LinearFieldsAreForetold) {
  Volume ramp = testing::gyroid({17, 17, 17});
  ramp.type = SampleType::f64;
  ramp.bytes.resize(ramp.grid.sample_count() * sizeof(double));
  auto* const samples = reinterpret_cast<double*>(ramp.bytes.data());
  for (int i = 0; i < 17 * 17 * 17; ++i) {
    const int x = i % 17, y = i / 17 % 17, z = i / 289;
    samples[i] = 1.3 * x + 0.7 * y + 0.9 * z;
  }
  const FieldHierarchy delta(ramp, {.range = {17.03, 29.41}});
  std::size_t sides = 0, cuts = 0, updates = 0, far = 0;
  delta.set().for_each_down([&](const Place& p) {
    const Diamond d(delta.set().centre(p));
    const DiamondContext c = delta.context(d);
    const auto q = delta.cuts(d);
    std::vector<std::uint8_t> residuals(q.size());
    Prediction prediction(c);
    sides += prediction.side() != delta.side(d.centre);
    prediction.encode(delta.side(d.centre), q, residuals.data());
    for (const std::uint8_t v : residuals) far += std::min<int>(v, 256 - v) > 8;
    cuts += q.size();
    ++updates;
  });
  EXPECT_LT(sides * 50, updates);
  EXPECT_LT(far * 20, cuts);
}

}  // namespace
}  // namespace intervale
