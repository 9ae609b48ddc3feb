// Properties of the mesh at any level of detail, of any range, on boxes of any shape.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/ivm/extraction.h"
#include "common/ivm/verify.h"
#include "common/mesh/io/mesh_writer.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/coverage.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/naive_volume.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"
#include "tests/support/split_sets.h"

namespace intervale {
namespace {

using testing::broken_law;

struct Trial {
  Volume volume;
  BuildOptions options;
  std::string text;
};

// A volume of random shape and kind with a random range: finite, infinite, equal, equal to samples, or one that misses
// the field.
Trial random_trial(unsigned seed) {
  std::mt19937 random(seed);
  const auto side = [&] { return std::int32_t(2 + random() % 12); };
  std::array<std::int32_t, 3> dims{side(), side(), side()};
  if (seed % 5 == 0) dims = {9, 9, 9};
  Trial trial;
  double low = 0, high = 0;
  switch (random() % 3) {
    case 0:
      trial.volume = testing::digits(dims, seed), low = -1, high = 10;
      break;
    case 1:
      trial.volume = testing::bump(dims, seed), low = 50, high = 100;
      break;
    default:
      trial.volume = testing::gyroid(dims), low = -1.6, high = 1.6;
  }
  trial.volume.grid.affine = Affine::of({0.5, 1, 3}, {-4, 0, 7});
  const auto value = [&] {
    const double v = low + (high - low) * double(random() % 1000) / 1000;
    return trial.volume.type == SampleType::u8 && random() % 2 == 0 ? std::floor(v) : v;
  };
  Range& r = trial.options.range;
  r = {value(), value()};
  if (r.alpha > r.beta) std::swap(r.alpha, r.beta);
  switch (random() % 8) {
    case 0:
      r.alpha = -kInf;
      break;
    case 1:
      r.beta = kInf;
      break;
    case 2:
      r = {-kInf, kInf};
      break;
    case 3:
      r.beta = r.alpha;
      break;
    case 4:
      r = {high + 10, high + 20};
      break;
    case 5:
      r.beta = r.alpha + (high - low) / 1000;
      break;
    default:
      break;
  }
  trial.options.refine = random() % 4 == 0 ? Refine::uniform : Refine::boundary;
  trial.text = "seed " + std::to_string(seed) + ", " + std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x " + std::to_string(dims[2]) +
               ", [" + std::to_string(r.alpha) + ", " + std::to_string(r.beta) + "]";
  return trial;
}

class Property : public ::testing::TestWithParam<unsigned> {};

TEST_P(Property, EveryLevelOfDetailIsRight) {
  const Trial trial = random_trial(GetParam());
  SCOPED_TRACE(trial.text);
  const bool sheet = trial.options.range.alpha == trial.options.range.beta;
  const FieldHierarchy delta(trial.volume, trial.options);
  const auto sigma = delta.compact();
  ASSERT_TRUE(sigma) << sigma.error().message;
  const auto valid = validate(*sigma);
  ASSERT_TRUE(valid) << valid.error().message;

  std::mt19937 random(GetParam() + 1000);
  const Grid& g = trial.volume.grid;
  std::uint64_t finer = std::numeric_limits<std::uint64_t>::max();
  for (int level = 0; level < 4; ++level) {
    Lod lod;
    if (level > 0) lod.error_percent = 20.0 * level * double(random() % 100) / 100;
    if (level == 3) {
      Box box;
      for (int i = 0; i < 3; ++i) {
        box.min[i] = g.affine.origin()[i] + g.affine.spacing()[i] * double(random() % g.dims[i]);
        box.max[i] = box.min[i] + g.affine.spacing()[i] * double(random() % 3);
      }
      lod.roi = box;
    }
    const auto extracted = extract(*sigma, lod);
    ASSERT_TRUE(extracted) << extracted.error().message;
    if (level == 0) finer = extracted->updates;
    EXPECT_LE(extracted->updates, finer);
    EXPECT_EQ(extracted->front.validate(), std::nullopt);
    const Mesh mesh = extracted->front.mesh();
    EXPECT_EQ(broken_law(mesh, g, sheet), "");
    EXPECT_EQ(mesh.tets.size(), extracted->front.tet_count());
    if (level == 0) {
      EXPECT_EQ(mesh.tets.size(), sigma->description().full.tets);
      EXPECT_EQ(mesh.points.size(), sigma->description().full.vertices);
    }
    // The volume is the naive sum's, but for the rounding of the cuts.
    const SplitSet split = select(*sigma, lod);
    const auto is_in = [&sigma](const SplitSet& some) {
      return [&sigma, &some](Vertex c) {
        const auto place = sigma->set().find(c);
        return place && some.contains(*place);
      };
    };
    const auto naive = testing::naive_sum(trial.volume, trial.options.range, is_in(split));
    const double unit = g.affine.spacing()[0] * g.affine.spacing()[1] * g.affine.spacing()[2];
    EXPECT_NEAR(volume_of(mesh) / unit, naive.volume, 0.01 * naive.cut_volume + 1e-9);
    // The same splits from the field's hierarchy, and the points that follow from the samples.
    if (level < 3) {
      const double threshold = error_of(lod, sigma->description().max_error);
      const SplitSet from_delta = select(delta.set(), [&](const Place& p) { return threshold == 0 || double(sigma->error(p.index)) > threshold; });
      const SplitSet shown = testing::shown_of(delta, trial.options.refine, from_delta);
      EXPECT_EQ(shown, split) << "nothing more is wanted than what changes the mesh";
      EXPECT_EQ(extracted->updates, shown.count());
      if (level == 0) {
        EXPECT_EQ(shown, from_delta) << "all of the full mesh is shown";
      }
      EXPECT_EQ(testing::points_of(mesh, g), testing::naive_points(trial.volume, trial.options.range, is_in(shown)));
    }
  }
}

TEST_P(Property, BoxesThatDoNotNestKeepTheGuaranteeAtSamples) {
  const Trial trial = random_trial(GetParam());
  SCOPED_TRACE(trial.text);
  const FieldHierarchy delta(trial.volume, trial.options);
  const auto sigma = delta.compact();
  ASSERT_TRUE(sigma);
  Lod lod;
  lod.error_percent = 15;
  const double epsilon = error_of(lod, sigma->description().max_error);
  const auto extracted = extract(*sigma, lod);
  ASSERT_TRUE(extracted);
  const Mesh mesh = extracted->front.mesh();
  EXPECT_EQ(testing::broken_guarantee(trial.volume, mesh, trial.options.range, epsilon), "");
}

INSTANTIATE_TEST_SUITE_P(Random, Property, testing::seeds(1, 60));

}  // namespace
}  // namespace intervale
