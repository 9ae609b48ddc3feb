#include "common/view/screen_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::NaiveCamera;
using testing::Vector;

// World coordinates that are not the samples'.
const Grid kGrid{{40, 30, 20}, Affine::of({0.5, 1, 3}, {-4, 100, 7})};

Vector world(const Grid& g, const Vector& sample) {
  return {g.affine.origin()[0] + g.affine.spacing()[0] * sample[0], g.affine.origin()[1] + g.affine.spacing()[1] * sample[1],
          g.affine.origin()[2] + g.affine.spacing()[2] * sample[2]};
}

// The region of this size in world units that has its middle there.
ScreenError::Region region_at(const Grid& g, const Vector& middle, const Vector& reach = {}) {
  ScreenError::Region region;
  for (int i = 0; i < 3; ++i) {
    region.middle[i] = (middle[i] - g.affine.origin()[i]) / g.affine.spacing()[i];
    region.reach[i] = reach[i] / g.affine.spacing()[i];
  }
  return region;
}

ScreenError::Region random_region(const Grid& g, std::mt19937& random) {
  ScreenError::Region region;
  const double size = std::pow(10.0, testing::uniform(random, -2, 0));
  for (int i = 0; i < 3; ++i) {
    region.middle[i] = testing::uniform(random, 0, 1) * g.dims[i];
    region.reach[i] = random() % 5 == 0 ? 0 : testing::uniform(random, 0, size) * g.dims[i];
  }
  return region;
}

class Views : public ::testing::TestWithParam<unsigned> {
 protected:
  std::mt19937 random_{GetParam()};  // the seed is the test's number
};

TEST_P(Views, NothingInThePictureShowsLarger) {
  std::size_t seen = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Camera camera = testing::random_camera(kGrid, random_);
    const ScreenError view(camera, kGrid);
    const NaiveCamera naive(camera);
    const ScreenError::Region region = random_region(kGrid, random_);
    const double pixels = view.pixels_per_unit(region);
    for (int i = 0; i < 40; ++i) {
      Vector sample;
      for (int k = 0; k < 3; ++k) sample[k] = region.middle[k] + region.reach[k] * testing::uniform(random_, -1, 1);
      const Vector p = world(kGrid, sample);
      if (!naive.shows(p) || naive.depth(p) < 1e-3 * 0.5) continue;  // nothing is taken to be nearer than a thousandth of the least spacing
      ++seen;
      EXPECT_LE(naive.pixels_per_unit(p), pixels * (1 + 1e-9)) << "trial " << trial;
      // Across the line of sight that is what the pinhole shows, however far; and along any other line the corners'
      // slant more.
      const double length = naive.depth(p) * testing::uniform(random_, 0, 0.5);
      const Vector any = testing::random_direction(random_), across = testing::unit(testing::cross(naive.ahead(), any));
      EXPECT_LE(naive.pixels_between(p, testing::along(p, length, across)), pixels * length * (1 + 1e-6)) << "trial " << trial;
      const double little = 1e-4 * naive.depth(p);
      EXPECT_LE(naive.pixels_between(p, testing::along(p, little, any)), pixels * little * naive.slant() * (1 + 1e-2)) << "trial " << trial;
    }
  }
  EXPECT_GT(seen, 500u);
}

// What bricks are passed over by.
TEST_P(Views, ARegionHasNoFewerPixelsThanAnythingInIt) {
  for (int trial = 0; trial < 2000; ++trial) {
    const ScreenError view(testing::random_camera(kGrid, random_), kGrid);
    const ScreenError::Region whole = random_region(kGrid, random_);
    ScreenError::Region part;
    for (int k = 0; k < 3; ++k) {
      part.reach[k] = whole.reach[k] * testing::uniform(random_, 0, 0.5);
      part.middle[k] = whole.middle[k] + (whole.reach[k] - part.reach[k]) * testing::uniform(random_, -1, 1);
    }
    EXPECT_LE(view.pixels_per_unit(part), view.pixels_per_unit(whole) * (1 + 1e-9)) << "trial " << trial;
  }
}

TEST_P(Views, PixelsAreFiniteAndAboveZeroEvenAroundTheEye) {
  for (int trial = 0; trial < 500; ++trial) {
    Camera camera = testing::random_camera(kGrid, random_);
    ScreenError::Region region = random_region(kGrid, random_);
    switch (trial % 4) {
      case 0:  // the eye in the region's middle, then in a corner of it, then anywhere inside, then anywhere
        camera.eye = world(kGrid, region.middle);
        break;
      case 1:
        for (int k = 0; k < 3; ++k) camera.eye[k] = kGrid.affine.origin()[k] + kGrid.affine.spacing()[k] * (region.middle[k] - region.reach[k]);
        break;
      case 2:
        for (int k = 0; k < 3; ++k) {
          camera.eye[k] =
              kGrid.affine.origin()[k] + kGrid.affine.spacing()[k] * (region.middle[k] + region.reach[k] * testing::uniform(random_, -1, 1));
        }
        break;
      default:
        break;
    }
    if (!check_lod({.camera = camera})) continue;
    const double pixels = ScreenError(camera, kGrid).pixels_per_unit(region);
    EXPECT_TRUE(std::isfinite(pixels) && pixels > 0) << "trial " << trial << ": " << pixels;
  }
}

// A region goes from the middle of the picture across its edge, and on.
TEST_P(Views, NothingJumpsAtThePicturesEdge) {
  for (int trial = 0; trial < 40; ++trial) {
    const Camera camera = testing::random_camera(kGrid, random_);
    const ScreenError view(camera, kGrid);
    const NaiveCamera naive(camera);
    const double distance = testing::uniform(random_, 5, 100), step = distance / 5000;
    const Vector reach{distance * testing::uniform(random_, 0, 0.05), distance * testing::uniform(random_, 0, 0.05), 0};
    const Vector across = testing::unit(testing::cross(naive.ahead(), testing::random_direction(random_)));
    const double reach_across = reach[0] * std::abs(across[0]) + reach[1] * std::abs(across[1]);
    Vector at = testing::along(camera.eye, distance, naive.ahead());
    double last = view.pixels_per_unit(region_at(kGrid, at, reach));
    for (int i = 0; i < 5000; ++i) {
      at = testing::along(at, step, across);
      const double now = view.pixels_per_unit(region_at(kGrid, at, reach));
      // Neither the depth nor the way outside changes by more than the step.
      EXPECT_LE(std::abs(std::log(now / last)), 60 * step / distance) << "trial " << trial << ", step " << i;
      if (step * i > reach_across) {
        EXPECT_LE(now, last * (1 + 1e-9)) << "trial " << trial << ", step " << i << ": all of it goes away sideways";
      }
      last = now;
    }
  }
}

// The same region at the same distance, further and further around the eye.
TEST_P(Views, TheFurtherRoundTheSmaller) {
  for (int trial = 0; trial < 40; ++trial) {
    Camera camera = testing::random_camera(kGrid, random_);
    camera.fov = testing::uniform(random_, 2, 90);
    camera.viewport = trial % 2 == 0 ? std::array<int, 2>{1920, 1080} : std::array<int, 2>{600, 800};
    const ScreenError view(camera, kGrid);
    const NaiveCamera naive(camera);
    const double distance = testing::uniform(random_, 5, 100);
    const Vector across = trial % 3 == 0 ? naive.right() : trial % 3 == 1 ? naive.up() : testing::along(testing::Vector{}, -1, naive.right());
    const double edge = trial % 3 == 1 ? naive.half_height() : naive.half_width();
    const auto pixels_at = [&](double angle) {
      const Vector at = testing::along(testing::along(camera.eye, distance * std::cos(angle), naive.ahead()), distance * std::sin(angle), across);
      return view.pixels_per_unit(region_at(kGrid, at));
    };
    double last = pixels_at(edge);
    EXPECT_GE(last * (1 + 1e-9), pixels_at(0));
    for (int i = 1; i <= 1000; ++i) {
      const double now = pixels_at(edge + (std::numbers::pi - edge) * i / 1000);
      EXPECT_LE(now, last * (1 + 1e-9)) << "trial " << trial << ", step " << i << ", fov " << camera.fov;
      last = now;
    }
    EXPECT_LE(last, pixels_at(edge) / 4) << "trial " << trial << ", fov " << camera.fov << ": right behind the eye";
  }
}

// What lies behind the eye, and goes away from it backwards.
TEST_P(Views, TheFurtherBehindTheSmaller) {
  for (int trial = 0; trial < 100; ++trial) {
    const Camera camera = testing::random_camera(kGrid, random_);
    const ScreenError view(camera, kGrid);
    const NaiveCamera naive(camera);
    const double size = testing::uniform(random_, 0, 5), step = testing::uniform(random_, 0.1, 2);
    const Vector reach{size * testing::uniform(random_, 0, 1), size * testing::uniform(random_, 0, 1), size * testing::uniform(random_, 0, 1)};
    const Vector aside = testing::unit(testing::cross(naive.ahead(), testing::random_direction(random_)));
    Vector at = testing::along(testing::along(camera.eye, testing::uniform(random_, 0, 20), aside), -2 * size - 0.1, naive.ahead());
    double last = view.pixels_per_unit(region_at(kGrid, at, reach));
    for (int i = 0; i < 50; ++i) {
      at = testing::along(at, -step, naive.ahead());
      const double now = view.pixels_per_unit(region_at(kGrid, at, reach));
      EXPECT_LE(now, last * (1 + 1e-9)) << "trial " << trial << ", step " << i;
      last = now;
    }
  }
}

TEST_P(Views, TheShareOfWhatIsAllSeenIsTheMeanOverItsParts) {
  std::size_t seen = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Camera camera = testing::random_camera(kGrid, random_);
    const NaiveCamera naive(camera);
    const ScreenError view(camera, kGrid);
    const ScreenError::Region region = random_region(kGrid, random_);
    const auto at = [&](const Vector& from_middle) {
      Vector sample;
      for (int k = 0; k < 3; ++k) sample[k] = region.middle[k] + region.reach[k] * from_middle[k];
      return world(kGrid, sample);
    };
    bool is_all_seen = true;
    double sum = 0, nearest = 1e300;
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          is_all_seen = is_all_seen && naive.shows(at({double(x), double(y), double(z)}));
          const Vector middle = at({x / 1.5, y / 1.5, z / 1.5});
          sum += std::pow(naive.pixels_per_unit(middle) / view.pixels_per_unit(region), 4);
          nearest = std::min(nearest, naive.depth(middle));
        }
      }
    }
    const double radius = testing::length(testing::minus(at({1.0 / 3, 1.0 / 3, 1.0 / 3}), at({})));
    if (!is_all_seen || nearest <= radius) continue;
    EXPECT_NEAR(view.seen_share(region), sum / 27, 1e-9) << "trial " << trial;
    ++seen;
  }
  EXPECT_GT(seen, 20u);
}

TEST_P(Views, TheShareOfWhatIsBesideThePictureIsTheLeast) {
  std::size_t beside = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Camera camera = testing::random_camera(kGrid, random_);
    const NaiveCamera naive(camera);
    const ScreenError view(camera, kGrid);
    const ScreenError::Region region = random_region(kGrid, random_);
    const double share = view.seen_share(region);
    ASSERT_GE(share, 1e-6);
    ASSERT_LE(share, 1);
    bool is_behind = true;
    for (int corner = 0; corner < 8; ++corner) {
      Vector sample;
      for (int k = 0; k < 3; ++k) sample[k] = region.middle[k] + ((corner >> k & 1) != 0 ? 1 : -1) * region.reach[k];
      is_behind = is_behind && naive.depth(world(kGrid, sample)) < 0;
    }
    if (!is_behind) continue;
    EXPECT_EQ(share, 1e-6) << "trial " << trial;
    ++beside;
  }
  EXPECT_GT(beside, 20u);
}

// World units are no more than a choice: the same picture of the same samples.
TEST_P(Views, SpacingAndOriginAreWhereTheSamplesLie) {
  const Grid unit{kGrid.dims, {}};
  for (int trial = 0; trial < 200; ++trial) {
    const double scale = testing::uniform(random_, 0.01, 50);
    const Vector shift{testing::uniform(random_, -99, 99), testing::uniform(random_, -99, 99), testing::uniform(random_, -99, 99)};
    const Grid moved{unit.dims, Affine::of({scale, scale, scale}, shift)};
    const Camera camera = testing::random_camera(unit, random_);
    Camera same = camera;
    for (int k = 0; k < 3; ++k) {
      same.eye[k] = shift[k] + scale * camera.eye[k];
      same.look_at[k] = shift[k] + scale * camera.look_at[k];
      same.up[k] = scale * camera.up[k];
    }
    const ScreenError::Region region = random_region(unit, random_);
    const double pixels = ScreenError(camera, unit).pixels_per_unit(region);
    EXPECT_NEAR(ScreenError(same, moved).pixels_per_unit(region) * scale, pixels, 1e-6 * pixels) << "trial " << trial;
  }
}

INSTANTIATE_TEST_SUITE_P(Random, Views, ::testing::Range(1u, 9u));

}  // namespace
}  // namespace intervale
