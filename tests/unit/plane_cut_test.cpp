#include "common/mesh/plane_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::cross;
using testing::dot;
using testing::length;
using testing::minus;
using testing::uniform;
using testing::Vector;

// A block of n^3 unit cubes from the origin, each of six positive tetrahedra.
Mesh block(std::uint32_t n) {
  Mesh mesh;
  const std::uint32_t side = n + 1;
  for (std::uint32_t i = 0; i < side * side * side; ++i) {
    const std::uint32_t x = i % side, y = i / side % side, z = i / (side * side);
    mesh.points.push_back({double(x), double(y), double(z)});
    mesh.surface.push_back(Surface::inside);
  }
  const std::array<std::uint32_t, 3> step{1, side, side * side};
  for (std::uint32_t z = 0; z < n; ++z)
    for (std::uint32_t y = 0; y < n; ++y)
      for (std::uint32_t x = 0; x < n; ++x) {
        std::array<std::uint32_t, 3> axes{0, 1, 2};
        do {
          const std::uint32_t a = x + side * (y + side * z), b = a + step[axes[0]], c = b + step[axes[1]], d = c + step[axes[2]];
          const bool even = (axes[0] < axes[1]) == ((axes[1] < axes[2]) == (axes[0] < axes[2]));
          mesh.tets.push_back(even ? std::array{a, b, c, d} : std::array{a, c, b, d});
        } while (std::next_permutation(axes.begin(), axes.end()));
      }
  return mesh;
}

// Twice the area of a polygon, along its own normal.
Vector twice_area(const TetCut& cut) {
  Vector sum{};
  for (std::size_t i = 1; i + 1 < cut.count; ++i) {
    const Vector n = cross(minus(cut.corners[i], cut.corners[0]), minus(cut.corners[i + 1], cut.corners[0]));
    for (std::size_t axis = 0; axis < 3; ++axis) sum[axis] += n[axis];
  }
  return sum;
}

double area(const std::vector<TetCut>& cuts) {
  double sum = 0;
  for (const TetCut& cut : cuts) sum += length(twice_area(cut)) / 2;
  return sum;
}

// Every cut is a proper polygon in the plane, convex and counterclockwise from the normal's side, within its
// tetrahedron's edges.
void expect_proper(const std::vector<TetCut>& cuts, const Plane& plane) {
  for (const TetCut& cut : cuts) {
    ASSERT_TRUE(cut.count == 3 || cut.count == 4) << int(cut.count);
    for (std::size_t i = 0; i < cut.count; ++i) {
      const Vector &a = cut.corners[i], &b = cut.corners[(i + 1) % cut.count], &c = cut.corners[(i + 2) % cut.count];
      ASSERT_NEAR(dot(minus(a, plane.point), plane.normal), 0, 1e-12 * length(plane.normal));
      ASSERT_GE(dot(cross(minus(b, a), minus(c, b)), plane.normal), -1e-12 * length(plane.normal));
    }
    ASSERT_GT(dot(twice_area(cut), plane.normal), 0);
  }
}

TEST(PlaneCut, OfABlockHasTheAreaOfItsSection) {
  const Mesh mesh = block(3);
  const double root2 = std::sqrt(2), root3 = std::sqrt(3);
  struct Case {
    Plane plane;
    double area;
  };
  for (const Case& c : {Case{{{1.3, 0, 0}, {1, 0, 0}}, 9},
                        {{{0, 1.7, 0}, {0, -2, 0}}, 9},
                        {{{0, 0, 1}, {0, 0, 1}}, 9},  // through points, edges and faces of the tetrahedra
                        {{{0, 0, 1}, {0, 0, -1}}, 9},
                        {{{1.5, 1.5, 1.5}, {1, 1, 0}}, 9 * root2},
                        {{{1.5, 1.5, 1.5}, {1, -1, 0}}, 9 * root2},
                        {{{1.5, 1.5, 1.5}, {1, 1, 1}}, 27 * root3 / 4},  // a regular hexagon with sides of 3 / sqrt(2)
                        {{{1, 0, 0}, {1, 1, 1}}, root3 / 2}}) {
    const auto cuts = plane_cut(mesh, c.plane);
    expect_proper(cuts, c.plane);
    EXPECT_NEAR(area(cuts), c.area, 1e-12);
  }
}

TEST(PlaneCut, HasNothingBehindAFaceAndAllOfItBefore) {
  const Mesh mesh = block(2);
  EXPECT_NEAR(area(plane_cut(mesh, {{2, 0, 0}, {1, 0, 0}})), 4, 1e-12);  // all is behind it
  EXPECT_TRUE(plane_cut(mesh, {{2, 0, 0}, {-1, 0, 0}}).empty());         // all is beyond it
  EXPECT_TRUE(plane_cut(mesh, {{9, 0, 0}, {1, 0, 0}}).empty());
  EXPECT_TRUE(plane_cut(Mesh{}, {{0, 0, 0}, {1, 0, 0}}).empty());
}

TEST(PlaneCut, OfOneTetrahedronInAllItsPositions) {
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.surface.assign(4, Surface::inside);
  mesh.tets = {{0, 1, 2, 3}};
  std::mt19937 random(5);
  int quadrilaterals = 0, triangles = 0;
  for (int i = 0; i < 1000; ++i) {
    const Plane plane{{uniform(random, 0, 0.5), uniform(random, 0, 0.5), uniform(random, 0, 0.5)},
                      {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)}};
    const auto cuts = plane_cut(mesh, plane);
    expect_proper(cuts, plane);
    for (const auto& cut : cuts) ++(cut.count == 4 ? quadrilaterals : triangles);
  }
  EXPECT_GT(quadrilaterals, 100);
  EXPECT_GT(triangles, 100);
  // Corners in the plane: a quadrilateral with two corners in one is a triangle.
  for (const Plane& plane : {Plane{{0, 0, 0}, {1, -1, 0}}, Plane{{0, 0, 0}, {1, -2, 0}}, Plane{{0, 0, 0}, {1, 1, -1}}}) {
    const auto cuts = plane_cut(mesh, plane);
    ASSERT_EQ(cuts.size(), 1u);
    EXPECT_EQ(cuts[0].count, 3);
    expect_proper(cuts, plane);
  }
  EXPECT_TRUE(plane_cut(mesh, {{0, 0, 0}, {-1, -1, -1}}).empty());  // a corner
  EXPECT_TRUE(plane_cut(mesh, {{0, 0, 0}, {-1, -1, 0}}).empty());   // an edge
}

TEST(PlaneCut, SharesPointsBetweenNeighbours) {
  const Mesh mesh = block(3);
  const auto cuts = plane_cut(mesh, {{1.37, 1.1, 1.6}, {0.3, -0.7, 0.5}});
  // Each side of a polygon has a neighbour's along it, the other way, or lies in the block's face.
  std::vector<std::pair<Vector, Vector>> sides;
  for (const auto& cut : cuts)
    for (std::size_t i = 0; i < cut.count; ++i) sides.emplace_back(cut.corners[i], cut.corners[(i + 1) % cut.count]);
  std::sort(sides.begin(), sides.end());
  for (const auto& [a, b] : sides) {
    bool outside = false;
    for (std::size_t axis = 0; axis < 3; ++axis) outside = outside || (a[axis] == b[axis] && (a[axis] == 0 || a[axis] == 3));
    EXPECT_NE(outside, std::binary_search(sides.begin(), sides.end(), std::pair(b, a)));
  }
}

TEST(PlaneCut, NamesTheEdgeOfEachCorner) {
  const Mesh mesh = block(3);
  const Plane plane{{1.37, 1.1, 1.6}, {0.3, -0.7, 0.5}}, through_points{{1, 1, 1}, {1, -1, 0}};
  for (const Plane& p : {plane, through_points}) {
    const std::vector<double> distances = plane_distances(mesh, p);
    for (const TetCut& cut : plane_cut(mesh, p)) {
      for (std::size_t i = 0; i < cut.count; ++i) {
        const CutEdge& on = cut.on[i];
        EXPECT_LT(distances[on.kept], 0);
        EXPECT_GE(distances[on.away], 0);
        EXPECT_LT(length(minus(lerp(mesh.points[on.kept], mesh.points[on.away], on.fraction), cut.corners[i])), 1e-12);
      }
    }
  }
}

TEST(PlaneCut, WantsANormal) {
  EXPECT_TRUE(check_plane({{1, 2, 3}, {0, 0, -1e-9}}));
  for (const Plane& plane : {Plane{{0, 0, 0}, {0, 0, 0}}, Plane{{NAN, 0, 0}, {1, 0, 0}}, Plane{{0, 0, 0}, {0, INFINITY, 0}}}) {
    const auto checked = check_plane(plane);
    ASSERT_FALSE(checked);
    EXPECT_TRUE(checked.error().usage);
  }
}

}  // namespace
}  // namespace intervale
