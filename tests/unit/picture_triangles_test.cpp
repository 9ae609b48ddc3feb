#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/ivm/extraction.h"
#include "common/mesh/io/mesh_writer.h"
#include "common/picture/triangles.h"
#include "server/builder/field_hierarchy.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/cameras.h"

namespace intervale {
namespace {

using testing::cross;
using testing::dot;
using testing::length;
using testing::minus;
using testing::Vector;

constexpr int kSide = 25;
constexpr double kMiddle = (kSide - 1) / 2.0;
constexpr Box kBox{{0, 0, 0}, {kSide - 1, kSide - 1, kSide - 1}};

// Of the volume of distances to the middle, from the greatest down: alpha's ball encloses beta's.
Mesh shell(double outer, double inner) {
  std::vector<float> f;
  for (int z = 0; z < kSide; ++z)
    for (int y = 0; y < kSide; ++y)
      for (int x = 0; x < kSide; ++x) f.push_back(float(100 - std::hypot(x - kMiddle, y - kMiddle, z - kMiddle)));
  const Volume volume = testing::volume_of_type(SampleType::f32, {kSide, kSide, kSide}, f);
  const auto sigma = FieldHierarchy(volume, {.range = {100 - outer, 100 - inner}}).compact();
  EXPECT_TRUE(sigma);
  const auto extracted = extract(*sigma, {});
  EXPECT_TRUE(extracted);
  return extracted->front.mesh();
}

struct Face {
  Part part{};
  unsigned drawn = 0;  // sides
  std::array<Vector, 3> corners{}, normals{};
  std::array<float, 3> values{};
  [[nodiscard]] Vector area() const {
    Vector a = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    for (double& c : a) c /= 2;
    return a;
  }
};

Vector widened(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

std::vector<Face> faces_of(const Mesh& mesh, const TriangleOptions& options) {
  const Viewpoint viewpoint(three_quarter_view(kBox, std::nullopt), kBox);
  std::vector<Face> faces;
  for_each_triangle(mesh, options, viewpoint, [&](std::span<const Corner> corners) {
    ASSERT_EQ(corners.size() % 3, 0u);
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      Face& face = faces.emplace_back();
      face.part = Part(corners[i].look & 3);
      for (unsigned look = corners[i].look >> 2; look != 0; look >>= 1) face.drawn += look & 1;
      for (std::size_t j = 0; j < 3; ++j) {
        EXPECT_EQ(corners[i + j].look, corners[i].look);
        face.corners[j] = testing::along(viewpoint.centre, viewpoint.unit, widened(corners[i + j].position));
        face.normals[j] = widened(corners[i + j].normal);
        face.values[j] = corners[i + j].value;
        EXPECT_NEAR(length(face.normals[j]), 1, 1e-5);
      }
    }
  });
  return faces;
}

// Of what the faces enclose, and how open they are: 0 where they close.
double volume_in(const std::vector<Face>& faces) {
  double sum = 0;
  for (const Face& face : faces) sum += dot(face.area(), face.corners[0]) / 3;
  return sum;
}
double openness(const std::vector<Face>& faces) {
  Vector sum{};
  for (const Face& face : faces) sum = testing::along(sum, 1, face.area());
  return length(sum);
}

TEST(PictureTriangles, NormalsOfSurfacesAreSmooth) {
  const auto faces = faces_of(shell(9.3, 5.3), {});
  int alpha = 0, beta = 0;
  double sum = 0;
  for (const Face& face : faces) {
    ASSERT_TRUE(face.part == Part::alpha || face.part == Part::beta);
    ++(face.part == Part::alpha ? alpha : beta);
    EXPECT_EQ(face.drawn, 0u);
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector out = testing::unit(minus(face.corners[i], {kMiddle, kMiddle, kMiddle}));
      const double agreement = dot(face.normals[i], out) * (face.part == Part::alpha ? 1 : -1);
      EXPECT_GT(agreement, 0.9);  // cuts are placed to 1/256 of an edge: slivers may lean
      sum += agreement;
    }
  }
  EXPECT_GT(sum / (3.0 * double(faces.size())), 0.995);
  EXPECT_GT(alpha, 1000);
  EXPECT_GT(beta, 300);
}

TEST(PictureTriangles, SidesOfTheBoxAreFlat) {
  const auto faces = faces_of(shell(15, 13), {.edges = true});  // what the box leaves of it
  int box = 0;
  for (const Face& face : faces) {
    EXPECT_EQ(face.drawn, 3u);
    if (face.part != Part::box) continue;
    ++box;
    const Vector flat = testing::unit(face.area());
    for (const Vector& normal : face.normals) EXPECT_GT(dot(normal, flat), 0.9999);
    EXPECT_GT(std::max({std::abs(flat[0]), std::abs(flat[1]), std::abs(flat[2])}), 0.9999);
  }
  EXPECT_GT(box, 100);
}

TEST(PictureTriangles, CutAndWhatIsKeptEncloseWhatIsBehindThePlane) {
  const Mesh mesh = shell(9, 5);
  const double whole = volume_of(mesh);
  std::mt19937 random(4);
  for (int i = 0; i < 8; ++i) {
    const Vector normal = testing::random_direction(random);
    const Plane plane{{kMiddle, kMiddle, kMiddle}, normal}, other{plane.point, {-normal[0], -normal[1], -normal[2]}};
    const auto behind = faces_of(mesh, {.clip = plane}), before = faces_of(mesh, {.clip = other});
    EXPECT_LT(openness(behind), 1e-3);
    EXPECT_NEAR(volume_in(behind) + volume_in(before), whole, 1e-4 * whole);
    EXPECT_NEAR(volume_in(behind), whole / 2, 0.01 * whole);
    double section = 0;
    unsigned drawn = 0, sides = 0;
    for (const Face& face : behind) {
      for (const Vector& corner : face.corners) EXPECT_LT(dot(minus(corner, plane.point), normal), 1e-4);
      if (face.part != Part::cut) continue;
      section += length(face.area());
      drawn += face.drawn;
      EXPECT_GT(dot(face.area(), normal), -1e-6);
    }
    for (const TetCut& cut : plane_cut(mesh, plane)) sides += cut.count;
    EXPECT_EQ(drawn, sides);  // of each polygon its sides, and none between its triangles
    EXPECT_NEAR(section, std::numbers::pi * (81 - 25), 0.02 * std::numbers::pi * (81 - 25));
  }
}

TEST(PictureTriangles, ASheetWithoutThicknessHasTwoSides) {
  const auto faces = faces_of(shell(7, 7), {});
  double alpha = 0, beta = 0;
  for (const Face& face : faces) (face.part == Part::alpha ? alpha : beta) += length(face.area());
  EXPECT_GT(alpha, 500);
  EXPECT_NEAR(alpha, beta, 1e-3 * alpha);
  EXPECT_LT(openness(faces), 1e-3);
}

// The field is 100 less the distance to the middle. Inside it is linear between samples far apart.
TEST(PictureTriangles, HaveTheFieldsValues) {
  const Plane through_middle{{kMiddle, kMiddle, kMiddle}, {0.3, 0.5, -0.8}};
  const ValueSpan span{90, 94};  // alpha is 91, beta 95
  int cut = 0, whole = 0;
  const Mesh mesh = shell(9, 5);
  for (const Face& face : faces_of(mesh, {.clip = through_middle, .span = span, .values = mesh.value})) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double value = 90 + 4 * double(face.values[i]), distance = length(minus(face.corners[i], {kMiddle, kMiddle, kMiddle}));
      if (face.part != Part::cut) {
        EXPECT_EQ(face.values[i], face.part == Part::alpha ? 0.25F : 1.25F);
        continue;
      }
      ++cut;
      whole += std::abs(value - (100 - distance)) < 0.1 ? 1 : 0;
      EXPECT_NEAR(value, 100 - distance, 0.5);
    }
  }
  EXPECT_GT(cut, 3000);
  EXPECT_GT(whole, 0.9 * cut);
  for (const Face& face : faces_of(shell(9, 5), {})) EXPECT_EQ(face.values[0], 0);
}

TEST(PictureTriangles, AnEmptyMeshHasNone) {
  EXPECT_TRUE(faces_of(Mesh{}, {}).empty());
  EXPECT_TRUE(faces_of(Mesh{}, {.clip = Plane{{0, 0, 0}, {1, 0, 0}}}).empty());
}

}  // namespace
}  // namespace intervale
