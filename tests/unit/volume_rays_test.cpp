#include "common/picture/volume_rays.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/mesh/join.h"
#include "common/parallel/all_cores.h"
#include "common/picture/viewpoint.h"
#include "common/picture/volume_picture.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

using testing::Vector;

using Field = std::function<double(const Vector&)>;

Volume sampled(int side, const Field& field) {
  std::vector<float> f;
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) f.push_back(float(field({double(x), double(y), double(z)})));
  return testing::volume_of_type(SampleType::f32, {side, side, side}, f);
}

Mesh mesh_of(const Volume& volume, const Range& range) {
  const auto extracted = extract(testing::build(volume, {.range = range, .refine = Refine::uniform}), {});
  EXPECT_TRUE(extracted);
  return extracted->front.mesh();
}

Box cube(int side) { return {{0, 0, 0}, {side - 1.0, side - 1.0, side - 1.0}}; }

// Row by row, from the top.
std::vector<RayLight> traced(const Mesh& mesh, const VolumeRays& rays, const TransferFunction& transfer) {
  const std::size_t width = std::size_t(rays.camera.viewport[0]), height = std::size_t(rays.camera.viewport[1]);
  std::vector<RayLight> light(width * height);
  std::vector<int> seen(width * height);
  trace_rays(mesh, rays, transfer, on_all_cores, [&](const RayTile& tile, std::span<const RayLight> of) {
    std::size_t i = 0;
    for (int row = tile.top; row < tile.bottom; ++row) {
      for (int column = tile.left; column < tile.right; ++column, ++i) {
        light[std::size_t(row) * width + std::size_t(column)] = of[i];
        ++seen[std::size_t(row) * width + std::size_t(column)];
      }
    }
    EXPECT_EQ(i, of.size());
  });
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), std::ptrdiff_t(seen.size()));
  return light;
}

struct Line {
  Vector from, along;  // along: of length 1
};
Line line_of(const Camera& camera, int column, int row) {
  const testing::NaiveCamera naive(camera);
  const double scale = camera.viewport[1] / (2 * std::tan(camera.fov * std::numbers::pi / 360));
  Vector along = testing::along(naive.ahead(), (column + 0.5 - camera.viewport[0] / 2.0) / scale, naive.right());
  along = testing::along(along, (camera.viewport[1] / 2.0 - row - 0.5) / scale, naive.up());
  return {camera.eye, testing::unit(along)};
}

Camera small_view(const Box& box) {
  Camera camera = three_quarter_view(box, {});
  camera.viewport = {120, 90};
  return camera;
}

// The distances between which a line is in the box, and behind the plane.
std::array<double, 2> within(const Line& line, const Box& box, const std::optional<Plane>& clip) {
  std::array<double, 2> d{0, INFINITY};
  const auto keep = [&](double distance, double slope) {  // distance + slope * d <= 0
    if (slope > 0) d[1] = std::min(d[1], -distance / slope);
    if (slope < 0) d[0] = std::max(d[0], -distance / slope);
    if (slope == 0 && distance > 0) d[1] = -1;
  };
  for (std::size_t i = 0; i < 3; ++i) {
    keep(line.from[i] - box.max[i], line.along[i]);
    keep(box.min[i] - line.from[i], -line.along[i]);
  }
  if (clip) keep(testing::dot(testing::minus(line.from, clip->point), clip->normal), testing::dot(line.along, clip->normal));
  return d[0] < d[1] ? d : std::array<double, 2>{0, 0};
}

const TransferFunction& fog() {
  static const TransferFunction transfer([](double) { return TransferFunction::Optics{0.02, {0.25, 0.5, 1}}; });
  return transfer;
}

// All values look alike: a ray is opaque by its way through the box, wherever the tetrahedra's faces are.
void expect_fog(const Mesh& mesh, const VolumeRays& rays) {
  const auto light = traced(mesh, rays, fog());
  const double unit = testing::length(testing::minus(rays.box.max, rays.box.min)) / 100;
  const int width = rays.camera.viewport[0];
  for (int i = 0; i < int(light.size()); ++i) {
    const auto [begin, end] = within(line_of(rays.camera, i % width, i / width), rays.box, rays.clip);
    const double passes = std::pow(0.98, (end - begin) / unit);
    ASSERT_NEAR(light[std::size_t(i)].passes, passes, 1e-4) << i % width << ' ' << i / width;
    ASSERT_NEAR(light[std::size_t(i)].colour[1], (1 - passes) / 2, 1e-4);
  }
}

const Mesh& full_of_noise() {
  static const Mesh mesh = mesh_of(testing::digits({9, 9, 9}, 3), {-1, 10});
  return mesh;
}

TEST(VolumeRays, MeetEachPartOfTheMeshOnce) {
  std::mt19937 random(5);
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(i);
    Camera camera = testing::random_camera({.dims = {9, 9, 9}}, random);
    camera.viewport = {int(20 + random() % 60), int(20 + random() % 60)};
    VolumeRays rays{camera, cube(9), {}, {0, 9}};
    if (i % 3 == 0) rays.clip = Plane{{4, 4, 4}, testing::random_direction(random)};
    expect_fog(full_of_noise(), rays);
  }
}

// Rays in planes of the grid, along its edges and through its vertices.
TEST(VolumeRays, AlongFacesMeetEachPartOfTheMeshOnce) {
  for (const double fov : {30.0, 90.0}) {
    for (const Vector& eye : {Vector{4, 4, 20}, {4, 4, 4.5}, {-7, 4, 4}, {3.25, 5, 30}, {20, 20, 20}, {4, 30, 20}}) {
      Camera camera{.eye = eye, .look_at = {4, 4, 4}, .up = {0.1, 1, 0.2}, .fov = fov, .viewport = {65, 65}};
      if (eye[0] == 3.25) camera.look_at = {3.25, 5, 4};
      expect_fog(full_of_noise(), {camera, cube(9), {}, {0, 9}});
      camera.up = {0, 1, 0};
      expect_fog(full_of_noise(), {camera, cube(9), {}, {0, 9}});
    }
  }
}

TEST(VolumeRays, CountOverlappingMeshesOnce) {
  const Volume noise = testing::digits({9, 9, 9}, 4);
  const Mesh all = joined({mesh_of(noise, {-1, 6}), mesh_of(noise, {2, 10}), mesh_of(noise, {3, 4})});
  expect_fog(all, {small_view(cube(9)), cube(9), {}, {0, 9}});
}

// Opacity and colours of values.
TransferFunction::Optics look(double place) {
  static const OpacityCurve curve{{0, 0.01}, {0.3, 0.12}, {0.5, 0.01}, {1, 0.2}};
  return {opacity_at(curve, place), find_palette("viridis")->at(place)};
}

// Of a field, by its formula, in fine steps.
RayLight naive(const Field& field, const Range& range, const Line& line, const Box& box) {
  const auto [begin, end] = within(line, box, {});
  const double unit = testing::length(testing::minus(box.max, box.min)) / 100;
  const int steps = int((end - begin) * 40) + 1;
  std::array<double, 3> colour{};
  double passes = 1;
  for (int i = 0; i < steps; ++i) {
    const double value = field(testing::along(line.from, begin + (end - begin) * (i + 0.5) / steps, line.along));
    if (value < range.alpha || value > range.beta) continue;
    const auto optics = look((value - range.alpha) / (range.beta - range.alpha));
    const double absorbed = 1 - std::pow(1 - optics.opacity, (end - begin) / steps / unit);
    for (std::size_t k = 0; k < 3; ++k) colour[k] += passes * absorbed * optics.colour[k];
    passes *= 1 - absorbed;
  }
  return {{float(colour[0]), float(colour[1]), float(colour[2])}, float(passes)};
}

TEST(VolumeRays, ShowTheIntegralOfTheField) {
  const Range range{50, 80};
  const std::array<std::pair<Field, int>, 3> fields{{
      {[](const Vector& p) { return 10 + 1.5 * p[0] + 1.25 * p[1] + 0.75 * p[2]; }, 33},
      {[](const Vector& p) { return 100 - 1.2 * std::hypot(p[0] - 30.5, p[1] - 33, p[2] - 32); }, 65},
      {[](const Vector& p) { return 65 + 20 * std::sin(p[0] / 13) * std::cos(p[1] / 15) + p[2] / 4; }, 65},
  }};
  const TransferFunction transfer(look);
  std::mt19937 random(6);
  for (const auto& [field, side] : fields) {
    const Mesh mesh = mesh_of(sampled(side, field), range);
    double worst = 0, sum = 0;
    for (unsigned i = 0; i < testing::cases(6); ++i) {
      Camera camera = i == 0 ? small_view(cube(side)) : testing::random_camera({.dims = {side, side, side}}, random);
      camera.viewport = {120, 90};
      const auto light = traced(mesh, {camera, cube(side), {}, {range.alpha, range.beta}}, transfer);
      for (int j = 0; j < 100; ++j) {
        const int at = int(random() % light.size());
        const RayLight expected = naive(field, range, line_of(camera, at % 120, at / 120), cube(side)), &got = light[std::size_t(at)];
        worst = std::max(worst, double(std::abs(got.passes - expected.passes)));
        for (std::size_t k = 0; k < 3; ++k) worst = std::max(worst, double(std::abs(got.colour[k] - expected.colour[k])));
        sum += 1 - expected.passes;
      }
    }
    EXPECT_LT(worst, 0.02) << side;
    EXPECT_GT(sum, 10 * testing::cases(6)) << side;
  }
}

TEST(VolumeRays, DoNotDependOnTheOrderOfTheMesh) {
  const Mesh mesh = mesh_of(testing::gyroid({17, 17, 17}), {-0.5, 0.7});
  Mesh other = mesh;
  std::mt19937 random(7);
  std::vector<std::uint32_t> order(mesh.points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), random);
  for (std::size_t i = 0; i < order.size(); ++i) {
    other.points[order[i]] = mesh.points[i];
    other.value[order[i]] = mesh.value[i];
  }
  for (auto& tet : other.tets) {
    for (std::uint32_t& point : tet) point = order[point];
    std::swap(tet[0], tet[2]);
    std::swap(tet[1], tet[3]);
  }
  std::shuffle(other.tets.begin(), other.tets.end(), random);
  const VolumeRays rays{small_view(cube(17)), cube(17), {}, {-0.5, 0.7}};
  const TransferFunction transfer(look);
  const auto a = traced(mesh, rays, transfer), b = traced(other, rays, transfer);
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(a[i].passes, b[i].passes);
    ASSERT_EQ(a[i].colour, b[i].colour);
  }
}

TEST(VolumeRays, OfNothingAreClear) {
  const Camera camera{.eye = {9, 9, 9}, .look_at = {0, 0, 0}, .viewport = {65, 33}};
  for (const RayLight& light : traced({}, {camera, cube(9), {}, {0, 1}}, fog())) {
    EXPECT_EQ(light.passes, 1);
    EXPECT_EQ(light.colour, (std::array<float, 3>{}));
  }
}

TEST(VolumePicture, IsOpaqueInThePalettesColour) {
  const Palette palette = *find_palette("inferno");
  const Mesh mesh = mesh_of(sampled(5, [](const Vector& p) { return p[0]; }), {2, 4});
  Camera camera{.eye = {40, 2, 2}, .look_at = {0, 2, 2}, .up = {0, 0, 1}, .fov = 2, .viewport = {9, 7}};
  VolumeRays rays{camera, cube(5), {}, {2, 4}};
  const VolumeLook opaque{{{2, 1}}, palette, {2, 4}};
  const Pixels near = draw_volume(mesh, rays, opaque, serial);
  EXPECT_TRUE(near.has_drawing);
  ASSERT_EQ(near.rgb.size(), 9u * 7 * 3);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(near.rgb[3 * 31 + k], palette.bytes()[254][k], 6);
  rays.camera.eye = {-40, 2, 2};
  const Pixels far = draw_volume(mesh, rays, opaque, serial);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(far.rgb[3 * 31 + k], palette.bytes()[1][k], 6);
  rays.camera.look_at = {-80, 2, 2};
  EXPECT_FALSE(draw_volume(mesh, rays, opaque, serial).has_drawing);
}

}  // namespace
}  // namespace intervale
