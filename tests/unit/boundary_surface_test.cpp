#include "client/view/boundary_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

#include "client/core/stream_client.h"
#include "client/view/cross_section.h"
#include "client/view/tets_in_box.h"
#include "common/ivm/extraction.h"
#include "common/mesh/boundary.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/selection/stream_plan.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/seeds.h"
#include "tests/support/special_values.h"

namespace intervale {
namespace {

using Point = std::array<double, 3>;
using Corners = std::array<Point, 3>;

std::shared_ptr<const IntervalVolume> stretched_volume(const Volume& volume, const Range& range) {
  return testing::build_shared(testing::stretched(volume), {.range = range});
}

std::shared_ptr<const IntervalVolume> surfaces_volume(unsigned seed) {
  constexpr std::array<std::array<std::int32_t, 3>, 4> shapes{{{17, 17, 17}, {12, 7, 10}, {33, 2, 11}, {13, 40, 6}}};
  const auto& shape = shapes[seed / 2 % 4];
  if (seed % 2 == 0) return stretched_volume(testing::gyroid(shape), seed % 3 == 0 ? Range{-0.3, kInf} : Range{-0.3, 0.2});
  return stretched_volume(testing::digits(shape, seed), {3, 5.5});
}

Corners turned(Corners t) {  // the least corner first
  while (t[0] > t[1] || t[0] > t[2]) t = {t[1], t[2], t[0]};
  return t;
}

bool is_flat(const Corners& t) {
  Point u, v;
  for (int i = 0; i < 3; ++i) {
    u[i] = t[1][i] - t[0][i];
    v[i] = t[2][i] - t[0][i];
  }
  return std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) < 1e-12;
}

Point in_samples(const Point& world, const Grid& grid) {
  Point p;
  for (int i = 0; i < 3; ++i) p[i] = std::round((world[i] - grid.affine.origin()[i]) / grid.affine.spacing()[i] * 512) / 512;
  return p;
}

std::multiset<Corners> boundary_of(const Mesh& mesh, const Grid& grid) {
  std::multiset<Corners> triangles;
  for (const auto& t : boundary_triangles(mesh)) {
    Corners corners;
    for (int k = 0; k < 3; ++k) corners[k] = in_samples(mesh.points[t[k]], grid);
    if (!is_flat(corners)) triangles.insert(turned(corners));
  }
  return triangles;
}

// What a page has that takes up each change.
class Page {
 public:
  void take(BoundarySurface& surface, const BoundarySurface::Change& change, bool edges) {
    if (change.reset) pieces_.clear();
    for (const std::uint32_t id : change.removed) EXPECT_EQ(pieces_.erase(id), 1u);
    for (const std::uint32_t id : change.pieces) {
      const SurfacePiece piece = surface.piece(id, edges);
      EXPECT_EQ(piece.id, id);
      EXPECT_FALSE(piece.vertices.empty());
      EXPECT_EQ(piece.indices.size(), 3 * std::size_t(piece.triangles[0] + piece.triangles[1] + piece.triangles[2]));
      EXPECT_EQ(piece.edges.size(), 2 * std::size_t(piece.edge_counts[0] + piece.edge_counts[1] + piece.edge_counts[2]));
      for (const std::uint32_t index : piece.indices) ASSERT_LT(index, piece.vertices.size());
      pieces_[piece.id] = piece;
    }
  }
  [[nodiscard]] std::multiset<Corners> triangles() const {
    std::multiset<Corners> triangles;
    for (const auto& [id, piece] : pieces_) {
      for (std::size_t i = 0; i < piece.indices.size(); i += 3) {
        Corners t;
        for (int k = 0; k < 3; ++k) {
          const SurfaceVertex& v = piece.vertices[piece.indices[i + k]];
          t[k] = {v.x, v.y, v.z};
        }
        if (!is_flat(t)) triangles.insert(turned(t));
      }
    }
    return triangles;
  }
  [[nodiscard]] const std::map<std::uint32_t, SurfacePiece>& pieces() const { return pieces_; }

 private:
  std::map<std::uint32_t, SurfacePiece> pieces_;
};

class BoundarySurfaceOf : public ::testing::TestWithParam<unsigned> {
 public:
  std::shared_ptr<const IntervalVolume> volume = surfaces_volume(GetParam());
  const Grid& grid = volume->description().grid;
  std::mt19937 random{GetParam()};
};

TEST_P(BoundarySurfaceOf, WhatChangesAddsUpToTheMeshsBoundary) {
  const std::uint64_t full = volume->description().full.tets;
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  BoundarySurface surface(client->front());
  Page page;
  plan.set_lod({});
  for (int step = 0; step < 12; ++step) {
    if (step % 3 != 2) {
      if (const auto batch = plan.next(1024)) {
        ASSERT_TRUE(client->apply(batch->payload));
      }
    } else {  // more or less of it shown, so that splits are hidden and come back
      const Camera camera{.eye = {20.0 * step, 30, -50}, .look_at = {0, 0, 0}};
      client->look(camera);
      client->set_budget({.max_tets = full * (1 + random() % 4) / 4}, 0);
    }
    page.take(surface, surface.update(), step % 2 == 0);
    const Mesh mesh = client->mesh();
    ASSERT_EQ(page.triangles(), boundary_of(mesh, grid)) << "step " << step;
    ASSERT_NEAR(surface.volume(), volume_of(mesh), 1e-9 * (1 + volume_of(mesh)));
  }
}

TEST_P(BoundarySurfaceOf, PiecesMadeByAndByAreThoseMadeAtOnce) {
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  BoundarySurface surface(client->front());
  plan.set_lod({});
  while (const auto batch = plan.next(4096)) {
    ASSERT_TRUE(client->apply(batch->payload));
    (void)surface.update();
  }
  Page by_and_by, at_once;
  by_and_by.take(surface, surface.all(), true);
  BoundarySurface again(client->front());
  at_once.take(again, again.update(), true);
  EXPECT_EQ(surface.triangles(), again.triangles());
  EXPECT_EQ(surface.volume_bound(), 0) << "all is split";
  ASSERT_EQ(by_and_by.pieces().size(), at_once.pieces().size());
  for (const auto& [id, piece] : at_once.pieces()) {
    const SurfacePiece& other = by_and_by.pieces().at(id);
    EXPECT_EQ(piece.indices, other.indices);
    EXPECT_EQ(piece.edges, other.edges);
    ASSERT_EQ(piece.vertices.size(), other.vertices.size());
    for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
      const SurfaceVertex &a = piece.vertices[i], &b = other.vertices[i];
      EXPECT_EQ(std::tuple(a.x, a.y, a.z, a.nx, a.ny, a.nz, a.lod), std::tuple(b.x, b.y, b.z, b.nx, b.ny, b.nz, b.lod)) << "normals are exact sums";
    }
  }
}

TEST_P(BoundarySurfaceOf, AllTetrahedraLieInTheWholeBox) {
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  StreamPlan plan(volume);
  plan.set_lod({});
  if (const auto batch = plan.next(2048)) {
    ASSERT_TRUE(client->apply(batch->payload));
  }
  BoundarySurface surface(client->front());
  (void)surface.update();
  const Box all{{-1000, -1000, -1000}, {1000, 1000, 1000}};
  const TetsInBox tets = tets_in_box(surface, all, UINT64_MAX);
  EXPECT_EQ(tets.count, client->tet_count());
  EXPECT_EQ(tets.vertices.size(), 4 * tets.count);
  double volume_sum = 0;
  for (std::size_t i = 0; i < tets.vertices.size(); i += 4) {
    const auto from = [&](std::size_t k) {
      return Point{double(tets.vertices[i + k].x) - tets.vertices[i].x, double(tets.vertices[i + k].y) - tets.vertices[i].y,
                   double(tets.vertices[i + k].z) - tets.vertices[i].z};
    };
    const Point a = from(1), b = from(2), c = from(3);
    volume_sum += (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
  }
  EXPECT_NEAR(volume_sum * grid.affine.spacing()[0] * grid.affine.spacing()[1] * grid.affine.spacing()[2], surface.volume(),
              1e-4 * (1 + surface.volume()));
  const TetsInBox some = tets_in_box(surface, all, 5);
  EXPECT_EQ(some.count, std::min<std::uint64_t>(5, tets.count));
  EXPECT_EQ(some.out_of, tets.count);
}

// The areas of all cuts across one direction are the volume.
TEST_P(BoundarySurfaceOf, CutsAddUpToTheVolume) {
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  StreamPlan plan(volume);
  plan.set_lod({});
  while (const auto batch = plan.next(4096)) ASSERT_TRUE(client->apply(batch->payload));
  BoundarySurface surface(client->front());
  (void)surface.update();
  for (const Point direction : {Point{1, 0, 0}, Point{0.6, 0, 0.8}, Point{-2.0 / 3, 1.0 / 3, 2.0 / 3}}) {
    double low = kInf, high = -kInf;
    for (int corner = 0; corner < 8; ++corner) {
      double at = 0;
      for (int i = 0; i < 3; ++i) at += direction[i] * (grid.affine.origin()[i] + (corner >> i & 1) * grid.affine.spacing()[i] * (grid.dims[i] - 1));
      low = std::min(low, at);
      high = std::max(high, at);
    }
    constexpr int kCuts = 150;
    const double step = (high - low) / kCuts;
    double sum = 0;
    for (int n = 0; n < kCuts; ++n) {
      const auto cut = cross_section(surface, {direction, low + (n + 0.5) * step}).vertices;
      ASSERT_EQ(cut.size() % 3, 0u);
      for (std::size_t i = 0; i < cut.size(); i += 3) {
        const auto from = [&](std::size_t k) {
          return Point{(double(cut[i + k].x) - cut[i].x) * grid.affine.spacing()[0], (double(cut[i + k].y) - cut[i].y) * grid.affine.spacing()[1],
                       (double(cut[i + k].z) - cut[i].z) * grid.affine.spacing()[2]};
        };
        const Point a = from(1), b = from(2);
        const double area =
            (direction[0] * (a[1] * b[2] - a[2] * b[1]) + direction[1] * (a[2] * b[0] - a[0] * b[2]) + direction[2] * (a[0] * b[1] - a[1] * b[0])) /
            2;
        ASSERT_GE(area, -1e-4) << "faces the side that is cut away";
        sum += area * step;
      }
    }
    EXPECT_NEAR(sum, surface.volume(), 0.04 * surface.volume() + 1e-6);
  }
}

// A side of a section's triangle is drawn exactly if it is one of the cut tetrahedron's, and not a diagonal of a
// quadrilateral.
TEST_P(BoundarySurfaceOf, CutsDrawTheSidesOfTheirPolygons) {
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  StreamPlan plan(volume);
  plan.set_lod({});
  while (const auto batch = plan.next(4096)) ASSERT_TRUE(client->apply(batch->payload));
  BoundarySurface surface(client->front());
  (void)surface.update();
  double offset = 0.0123;  // beside the samples
  for (int i = 0; i < 3; ++i)
    offset += (grid.affine.origin()[i] + grid.affine.spacing()[i] * (grid.dims[i] - 1) / 2) * std::array{0.6, 0.64, 0.48}[i];
  const auto cut = cross_section(surface, {{0.6, 0.64, 0.48}, offset}).vertices;
  ASSERT_FALSE(cut.empty());
  std::multiset<std::array<std::array<float, 3>, 2>> drawn, diagonals;
  for (std::size_t first = 0; first < cut.size(); first += 3) {
    for (std::size_t k = 0; k < 3; ++k) {
      const SectionVertex &a = cut[first + (k + 1) % 3], &b = cut[first + (k + 2) % 3];
      EXPECT_EQ(cut[first + k].side[k], 255);
      EXPECT_EQ(a.side[k], b.side[k]);
      std::array<std::array<float, 3>, 2> side{{{a.x, a.y, a.z}, {b.x, b.y, b.z}}};
      std::sort(side.begin(), side.end());
      (a.side[k] == 0 ? drawn : diagonals).insert(side);
    }
  }
  for (const auto& side : diagonals) {
    EXPECT_EQ(diagonals.count(side), 2u) << "of two triangles of one quadrilateral";
    EXPECT_EQ(drawn.count(side), 0u) << "no face of a tetrahedron";
  }
}

INSTANTIATE_TEST_SUITE_P(Random, BoundarySurfaceOf, testing::seeds(0, 8));

// Where nothing hides in diamonds that look empty, the bound holds at every level of detail.
TEST(BoundarySurface, TheFullVolumeIsWithinTheBound) {
  const auto volume = stretched_volume(testing::gyroid({33, 33, 33}), {-0.3, 0.2});
  const double full = volume_of(extract(*volume, {})->front.mesh());
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  BoundarySurface surface(client->front());
  plan.set_lod({});
  double last = kInf;
  while (const auto batch = plan.next(2048)) {
    ASSERT_TRUE(client->apply(batch->payload));
    (void)surface.update();
    EXPECT_LE(std::abs(surface.volume() - full), surface.volume_bound() + 1e-9 * full);
    last = surface.volume_bound();
  }
  EXPECT_EQ(last, 0);
}

TEST(BoundarySurface, WhatForgetsIsMadeAfresh) {
  const auto volume = stretched_volume(testing::gyroid({17, 17, 17}), {-0.3, 0.2});
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description(), {.max_updates = 400});
  ASSERT_TRUE(client);
  BoundarySurface surface(client->front());
  Page page;
  plan.set_lod({});
  ASSERT_TRUE(client->apply(plan.next(1024)->payload));
  page.take(surface, surface.update(), false);
  client->look({.eye = {50, 60, 70}, .look_at = {0, 8, 20}});
  client->set_budget({.max_updates = client->updates() / 2}, 7);
  ASSERT_FALSE(client->give_up(7, 1000).empty());
  client->arrived(7);
  const auto change = surface.update();
  EXPECT_TRUE(change.reset);
  page.take(surface, change, false);
  EXPECT_EQ(page.triangles(), boundary_of(client->mesh(), volume->description().grid));
}

TEST(Normals, TheQuickArcTangentIsOffByLittle) {
  for (const double length : {1e-200, 1e-3, 1.0, 7e8}) {
    for (int i = 1; i < 4000; ++i) {
      const double angle = 3.14159265358979323846 * i / 4000, y = length * std::sin(angle), x = length * std::cos(angle);
      ASSERT_NEAR(quick_arc_tangent(y, x), std::atan2(y, x), 2e-5) << "length " << length << ", angle " << angle;
    }
  }
  EXPECT_NEAR(quick_arc_tangent(2.0, 0.0), std::atan2(2, 0), 1e-12);
}

TEST(Normals, TheNearestIntIsThatOfRint) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> some(-2147483000.0, 2147483000.0), small(-4, 4);
  for (int i = 0; i < 10000; ++i) {
    for (const double value : {some(random), small(random), double(i - 5000) / 2})
      ASSERT_EQ(nearest_int(value), std::int32_t(std::rint(value))) << value;
  }
}

}  // namespace
}  // namespace intervale
