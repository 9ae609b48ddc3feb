// Laws of grids whose axes are not the world's: what is seen, sent and stored is that of the plain grid, transformed.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "client/view/boundary_surface.h"
#include "client/view/cross_section.h"
#include "client/view/tets_in_box.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "common/ivm/refinement.h"
#include "common/mesh/boundary.h"
#include "common/mesh/plane_cut.h"
#include "protocol/codec.h"
#include "tests/support/affines.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/parts.h"
#include "tests/support/seeds.h"

namespace intervale {
namespace {

constexpr std::array<testing::Dims, 3> kObliqueBoxes{{{17, 17, 17}, {12, 7, 10}, {9, 20, 6}}};

double six_fold_volume(const Mesh& mesh, const std::array<std::uint32_t, 4>& t) {
  const Vec3& o = mesh.points[t[0]];
  return triple_product(subtract(mesh.points[t[1]], o), subtract(mesh.points[t[2]], o), subtract(mesh.points[t[3]], o));
}

class ObliqueGrid : public ::testing::TestWithParam<unsigned> {
 protected:
  // The same data set on another grid.
  [[nodiscard]] IntervalVolume moved(const Affine& to) const {
    IntervalVolume::Parts parts = testing::parts_of(plain_);
    parts.description.grid.affine = to;
    return std::move(*IntervalVolume::assemble(std::move(parts)));
  }
  [[nodiscard]] Vec3 random_point_in(const Box& box) {
    Vec3 p;
    for (std::size_t i = 0; i < 3; ++i) p[i] = testing::uniform(random_, box.min[i], box.max[i]);
    return p;
  }
  [[nodiscard]] Box random_box(const Box& in) {
    const Vec3 a = random_point_in(in), b = random_point_in(in);
    return {{std::min(a[0], b[0]), std::min(a[1], b[1]), std::min(a[2], b[2])}, {std::max(a[0], b[0]), std::max(a[1], b[1]), std::max(a[2], b[2])}};
  }

  std::mt19937 random_{GetParam()};
  testing::Trial trial_ = testing::trial_of_seed(GetParam(), kObliqueBoxes);
  IntervalVolume plain_ = testing::build(trial_);
  Affine map_ = testing::random_affine(random_, GetParam() % 5);
  Grid grid_{trial_.volume.grid.dims, map_};
};

// Through the builder, a file and the protocol.
TEST_P(ObliqueGrid, TheMeshIsThatOfThePlainGridTransformed) {
  Volume volume = trial_.volume;
  volume.grid = grid_;
  volume.labels = {"mm", "density", "HU", map_.is_mirrored() ? "LPS" : ""};
  const auto file = encode_ivm(testing::build(volume, trial_.options));
  const auto loaded = decode_ivm(file, "made");
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->description().labels, volume.labels);
  const auto message = protocol::decode_server_message(protocol::encode(protocol::ServerMessage(protocol::Opened{loaded->description(), {}})));
  ASSERT_TRUE(message) << message.error().message;
  EXPECT_EQ(std::get<protocol::Opened>(*message).description, loaded->description());
  ASSERT_EQ(loaded->description().grid, grid_);

  const Mesh before = extract(plain_, Lod())->front.mesh(), after = extract(*loaded, Lod())->front.mesh();
  ASSERT_EQ(testing::broken_law(before, trial_.volume.grid), "");
  ASSERT_EQ(after.points.size(), before.points.size());
  ASSERT_EQ(after.tets.size(), before.tets.size());
  double largest = 0;
  for (const Vec3& p : after.points) largest = std::max({largest, std::abs(p[0]), std::abs(p[1]), std::abs(p[2])});
  for (std::size_t i = 0; i < after.points.size(); ++i) {
    const Vec3 expected = map_.point(before.points[i]);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(after.points[i][k], expected[k], 1e-12 * largest);
  }
  for (std::size_t t = 0; t < after.tets.size(); ++t) {
    auto a = after.tets[t], b = before.tets[t];
    ASSERT_GT(six_fold_volume(after, a), 0);
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    ASSERT_EQ(a, b);
  }
  EXPECT_NEAR(volume_of(after), volume_of(before) * std::abs(map_.determinant()), 1e-9 * volume_of(after));
  double enclosed = 0;  // triangles outward
  for (const auto& [a, b, c] : boundary_triangles(after)) enclosed += triple_product(after.points[a], after.points[b], after.points[c]) / 6;
  EXPECT_NEAR(enclosed, volume_of(after), 1e-9 * (1 + largest * largest * largest));
}

TEST_P(ObliqueGrid, ARotationOfWorldAndCameraChoosesTheSameUpdates) {
  const auto axes = testing::random_axes(random_);
  const Affine turn = Affine::of_columns(axes, {});
  const IntervalVolume first = moved(map_), second = moved(testing::rotated(map_, axes));
  for (int k = 0; k < 8; ++k) {
    Lod lod;
    Camera& camera = lod.camera.emplace(testing::random_camera(trial_.volume.grid, random_));
    for (Vec3* p : {&camera.eye, &camera.look_at}) *p = map_.point(*p);
    camera.up = map_.direction(camera.up);
    if (!check_lod(lod)) continue;
    Lod other = lod;
    for (Vec3* v : {&other.camera->eye, &other.camera->look_at, &other.camera->up}) *v = turn.direction(*v);
    EXPECT_EQ(select(first, lod), select(second, other));
    EXPECT_EQ(in_order(first, select(first, lod), lod), in_order(second, select(second, other), other));
  }
}

TEST_P(ObliqueGrid, ARegionIsPermutedWithTheAxes) {
  std::array<std::size_t, 3> to{0, 1, 2};
  std::shuffle(to.begin(), to.end(), random_);
  std::array<Vec3, 3> columns{};
  std::array<double, 3> sign{};
  for (std::size_t j = 0; j < 3; ++j) columns[j][to[j]] = sign[j] = random_() % 2 == 0 ? -1 : 1;
  const IntervalVolume permuted = moved(Affine::of_columns(columns, {}));
  for (int k = 0; k < 8; ++k) {
    Lod lod;
    const Box roi = lod.roi.emplace(random_box(box_of(trial_.volume.grid)));
    const auto before = select(plain_, lod);
    for (std::size_t j = 0; j < 3; ++j) {
      lod.roi->min[to[j]] = std::min(sign[j] * roi.min[j], sign[j] * roi.max[j]);
      lod.roi->max[to[j]] = std::max(sign[j] * roi.min[j], sign[j] * roi.max[j]);
    }
    EXPECT_EQ(select(permuted, lod), before);
  }
}

TEST_P(ObliqueGrid, TetrahedraInABoxAreThoseWithTheirMiddlesThere) {
  const Front front = extract(moved(map_), Lod())->front;
  const Mesh mesh = front.mesh();
  BoundarySurface surface(front);
  (void)surface.update();
  for (int k = 0; k < 5; ++k) {
    const Box box = random_box(box_of(grid_));
    std::uint64_t expected = 0;
    for (const auto& t : mesh.tets) {
      bool inside = true;
      for (std::size_t i = 0; i < 3; ++i) {
        const double at = (mesh.points[t[0]][i] + mesh.points[t[1]][i] + mesh.points[t[2]][i] + mesh.points[t[3]][i]) / 4;
        inside = inside && at >= box.min[i] && at <= box.max[i];
      }
      expected += inside;
    }
    const TetsInBox found = tets_in_box(surface, box, 1 << 30);
    EXPECT_EQ(found.out_of, expected);
    ASSERT_EQ(found.vertices.size(), 4 * expected);
    for (std::size_t i = 0; i < found.vertices.size(); i += 4) {
      const auto at = [&](std::size_t corner) {
        const TetVertex& v = found.vertices[i + corner];
        return map_.point({v.x, v.y, v.z});
      };
      ASSERT_GT(triple_product(subtract(at(1), at(0)), subtract(at(2), at(0)), subtract(at(3), at(0))), 0);
    }
  }
}

TEST_P(ObliqueGrid, ACrossSectionIsThatOfTheMesh) {
  const Front front = extract(moved(map_), Lod())->front;
  const Mesh mesh = front.mesh();
  BoundarySurface surface(front);
  (void)surface.update();
  for (int k = 0; k < 5; ++k) {
    const Plane plane{random_point_in(box_of(grid_)), testing::random_direction(random_)};
    Vec3 expected{}, found{};  // areas along the normals of the triangles
    for (const TetCut& cut : plane_cut(mesh, plane)) {
      for (std::size_t i = 1; i + 1 < cut.count; ++i) {
        const Vec3 area = cross(subtract(cut.corners[i], cut.corners[0]), subtract(cut.corners[i + 1], cut.corners[0]));
        for (std::size_t c = 0; c < 3; ++c) expected[c] += area[c] / 2;
      }
    }
    const auto section = cross_section(surface, {plane.normal, dot(plane.normal, plane.point)}).vertices;
    for (std::size_t i = 0; i < section.size(); i += 3) {
      std::array<Vec3, 3> p;
      for (std::size_t c = 0; c < 3; ++c) p[c] = map_.point({section[i + c].x, section[i + c].y, section[i + c].z});
      for (const Vec3& corner : p) ASSERT_NEAR(dot(plane.normal, subtract(corner, plane.point)), 0, 1e-4);
      const Vec3 area = cross(subtract(p[1], p[0]), subtract(p[2], p[0]));
      for (std::size_t c = 0; c < 3; ++c) found[c] += area[c] / 2;
    }
    EXPECT_GE(dot(found, plane.normal), 0) << "they face the normal's side";
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-3 * (1 + length(expected)));
  }
}

TEST_P(ObliqueGrid, TheBoundarySurfaceEnclosesTheMeshAndItsNormalsPointOutward) {
  const Front front = extract(moved(map_), Lod())->front;
  const Mesh mesh = front.mesh();
  BoundarySurface surface(front);
  double enclosed = 0, outward = 0, area = 0;
  for (const std::uint32_t id : surface.all().pieces) {
    const SurfacePiece piece = surface.piece(id, false);
    for (std::size_t i = 0; i < piece.indices.size(); i += 3) {
      std::array<Vec3, 3> p;
      Vec3 normal{};
      const bool on_box = i / 3 >= piece.triangles[0] + piece.triangles[1];
      for (std::size_t c = 0; c < 3; ++c) {
        const SurfaceVertex& v = piece.vertices[piece.indices[i + c]];
        p[c] = map_.point({v.x, v.y, v.z});
        for (std::size_t k = 0; k < 3; ++k) normal[k] += std::array<double, 3>{double(v.nx), double(v.ny), double(v.nz)}[k] / (3 * 127);
      }
      enclosed += triple_product(p[0], p[1], p[2]) / 6;
      const Vec3 twice = cross(subtract(p[1], p[0]), subtract(p[2], p[0]));
      if (on_box && length(twice) > 1e-6) {
        ASSERT_NEAR(dot(normalized(twice), normal), 1, 0.02);
      }
      outward += dot(twice, normal);
      area += length(twice);
    }
  }
  EXPECT_GT(outward, 0.5 * area);
  EXPECT_NEAR(surface.volume(), volume_of(mesh), 1e-9 * volume_of(mesh));
  EXPECT_NEAR(enclosed, volume_of(mesh), 1e-3 * (1 + volume_of(mesh)));
}

INSTANTIATE_TEST_SUITE_P(Random, ObliqueGrid, testing::seeds(0, 20));

}  // namespace
}  // namespace intervale
