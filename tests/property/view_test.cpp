// Properties of a camera's mesh: on its screen it deviates from the full mesh by no more than was asked for.
#include "common/view/screen_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/mesh/boundary.h"
#include "common/mesh/io/mesh_writer.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/cameras.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"
#include "tests/support/surfaces.h"

namespace intervale {
namespace {

using testing::NaiveCamera;
using testing::SurfaceDistance;
using testing::Triangles;
using testing::Vector;

struct ViewTrial {
  Volume volume;
  Range range;
  int points;  // of each surface that are looked at
  std::string text;
};

ViewTrial trial_of_seed(unsigned seed) {
  ViewTrial trial;
  switch (seed % 5) {
    case 0:
      trial = {testing::gyroid({33, 33, 33}), {-0.3, 0.2}, 1500, "gyroid"};
      break;
    case 1:
      trial = {testing::bump({33, 33, 33}, seed), {30, kInf}, 3000, "bump"};
      break;
    case 2:
      trial = {testing::gyroid({40, 28, 30}), {0.2, kInf}, 1500, "gyroid in a box that does not nest"};
      break;
    case 3:
      trial = {testing::digits({21, 21, 21}, seed), {3, 5.5}, 1500, "digits"};
      break;
    default:
      trial = {testing::specks({33, 33, 33}, seed), {5, kInf}, 3000, "specks"};
  }
  if (seed % 2 == 1) {
    trial.volume.grid.affine = Affine::of({0.5, 1, 2}, {-4, 0, 7});
  }
  trial.text += ", seed " + std::to_string(seed);
  return trial;
}

// A camera from outside the box or from inside it, which sees much of it or little.
Camera camera_of(const Grid& g, int number, std::mt19937& random) {
  Camera camera;
  const double away = number == 0 ? 1.5 : number == 1 ? 0.7 : 0.3;
  const Vector from = testing::random_direction(random);
  for (int i = 0; i < 3; ++i) {
    const double side = g.affine.spacing()[i] * (g.dims[i] - 1), middle = g.affine.origin()[i] + side / 2;
    camera.eye[i] = middle + away * side * from[i];
    camera.look_at[i] = middle + side * testing::uniform(random, -0.1, 0.1);
  }
  do camera.up = testing::random_direction(random);
  while (testing::length(testing::cross(testing::unit(testing::minus(camera.look_at, camera.eye)), camera.up)) < 0.1);
  camera.fov = testing::uniform(random, 30, 70);
  camera.viewport = number % 2 == 0 ? std::array<int, 2>{320, 200} : std::array<int, 2>{200, 320};
  return camera;
}

// Pixels that points of one surface, those in the picture, are off the other one; ascending.
std::vector<double> pixels_off(const Triangles& from, const Triangles& to, int points, const NaiveCamera& camera, std::mt19937& random) {
  const SurfaceDistance distance(to);
  std::vector<double> off;
  for (const Vector& p : testing::points_on(from, points, random)) {
    if (camera.shows(p)) off.push_back(distance(p) * camera.pixels_per_unit(p));
  }
  std::sort(off.begin(), off.end());
  return off;
}

class Pictures : public ::testing::TestWithParam<unsigned> {};

TEST_P(Pictures, AreOffByNoMoreThanWasAskedFor) {
  const ViewTrial trial = trial_of_seed(GetParam());
  SCOPED_TRACE(trial.text);
  const auto sigma = FieldHierarchy(trial.volume, {.range = trial.range}).compact();
  ASSERT_TRUE(sigma) << sigma.error().message;
  const auto triangles_of = [&](const Lod& lod) {
    const Mesh mesh = extract(*sigma, lod)->front.mesh();
    return testing::triangles_of(mesh, boundary_triangles(mesh));
  };
  const Triangles full = triangles_of({});
  std::mt19937 random(GetParam());
  std::size_t points = 0, far_off = 0;  // further than twice what was asked for
  std::uint64_t updates = std::numeric_limits<std::uint64_t>::max();
  for (int number = 0; number < 3; ++number) {
    Lod lod;
    lod.camera = camera_of(trial.volume.grid, number, random);
    const NaiveCamera camera(*lod.camera);
    for (const double tau : {1.0, 2.0, 4.0, 8.0}) {
      lod.camera->pixel_error = tau;
      const Triangles seen = triangles_of(lod);
      updates = std::min(updates, select(*sigma, lod).count());
      ASSERT_FALSE(seen.empty());
      for (const bool back : {false, true}) {
        const auto off = back ? pixels_off(seen, full, trial.points, camera, random) : pixels_off(full, seen, trial.points, camera, random);
        if (off.empty()) continue;
        const auto text =
            "camera " + std::to_string(number) + ", " + std::to_string(off.size()) + " points seen" + (back ? ", from it to the full mesh" : "");
        if (off.size() >= 200) {  // of fewer, the hundredth part is one
          EXPECT_LE(off[off.size() * 99 / 100], tau) << text << ": 99 % of the points";
        }
        points += off.size();
        far_off += std::size_t(off.end() - std::upper_bound(off.begin(), off.end(), 2 * tau));
      }
    }
  }
  EXPECT_EQ(far_off, 0u) << "of " << points << " points";
  EXPECT_LT(updates, sigma->size()) << "nothing was left out";
}

INSTANTIATE_TEST_SUITE_P(Random, Pictures, testing::seeds(0, 10));

}  // namespace
}  // namespace intervale
