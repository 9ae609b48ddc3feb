#include "client/view/point_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>

#include "client/core/stream_client.h"
#include "client/view/cross_section.h"
#include "client/view/tets_in_box.h"
#include "common/selection/stream_plan.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"

namespace intervale {
namespace {

// The field x + 3 y - 2 z of samples; alpha and beta lie between its values.
constexpr Range kRange{-3.75, 16.25};
std::shared_ptr<const IntervalVolume> ramp(Refine refine) {
  constexpr std::array<std::int32_t, 3> kDims{17, 9, 12};
  std::vector<std::int16_t> samples;
  samples.reserve(17 * 9 * 12);
  for (int z = 0; z < kDims[2]; ++z)
    for (int y = 0; y < kDims[1]; ++y)
      for (int x = 0; x < kDims[0]; ++x) samples.push_back(std::int16_t(x + 3 * y - 2 * z));
  return testing::build_shared(testing::stretched(testing::volume_of_type(SampleType::i16, kDims, samples)), {.range = kRange, .refine = refine});
}

// Cuts are placed to 1/256 of an edge, along which the field changes by 6 at most.
constexpr double kTolerance = 6.0 / 256;
template <class V>
double ramp_at(const V& v) {
  return double(v.x) + 3 * double(v.y) - 2 * double(v.z);
}

TEST(PointValues, AreTheFieldsOnSurfacesInCutsAndAtTetrahedra) {
  const auto volume = ramp(Refine::uniform);
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  BoundarySurface surface(client->front());
  plan.set_lod({});
  while (const auto batch = plan.next(1024)) {
    ASSERT_TRUE(client->apply(batch->payload));
    const auto change = surface.update();
    const std::vector<float> values = point_values(surface);
    for (const std::uint32_t id : change.pieces) {
      const SurfacePiece piece = surface.piece(id, false);
      const std::vector<float> of_piece = values_of(piece.points, values);
      ASSERT_EQ(of_piece.size(), piece.vertices.size());
      for (std::size_t i = 0; i < of_piece.size(); ++i) {
        const bool is_inside = surface.surface(piece.points[i]) == Surface::inside;
        ASSERT_NEAR(of_piece[i], ramp_at(piece.vertices[i]), is_inside ? 0 : 16 * kTolerance);  // of edges of up to 16 samples
      }
    }
    const CrossSection section = cross_section(surface, {{0.6, 0.64, 0.48}, 20}, values);
    ASSERT_EQ(section.values.size(), section.vertices.size());
    for (std::size_t i = 0; i < section.values.size(); ++i) ASSERT_NEAR(section.values[i], ramp_at(section.vertices[i]), 16 * kTolerance);
    const TetsInBox tets = tets_in_box(surface, {{-100, -100, -100}, {100, 100, 100}}, 1000);
    ASSERT_EQ(tets.points.size(), tets.vertices.size());
    const std::vector<float> of_tets = values_of(tets.points, values);
    for (std::size_t i = 0; i < of_tets.size(); ++i) ASSERT_NEAR(of_tets[i], ramp_at(tets.vertices[i]), 16 * kTolerance);
  }
  EXPECT_GT(client->tet_count(), 1000u);
  EXPECT_TRUE(cross_section(surface, {{0.6, 0.64, 0.48}, 20}).values.empty());
}

// Lengths of vectors, which are the samples' places; and where the client has none, the least value.
TEST(PointValues, AreThoseOfAChannel) {
  IntervalVolume made = testing::build(testing::digits({13, 9, 10}, 5), {.range = {3, 5.5}});
  testing::set_channels(made, 5);
  const auto volume = std::make_shared<const IntervalVolume>(std::move(made));
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  const std::vector<std::size_t> place{1};
  plan.set_channels(place);
  plan.set_lod({});
  while (const auto batch = plan.next(4096)) ASSERT_TRUE(client->apply(batch->payload, 0, {}, {batch->channels, place}));
  BoundarySurface surface(client->front());
  (void)surface.update();
  const std::vector<float> lengths = point_values(surface, client->channels()[1]), unknown = point_values(surface, client->channels()[0]);
  const double least = volume->description().channels[0].components[0].format.least();
  std::size_t points = 0;
  for (const std::uint32_t id : surface.all().pieces) {
    const SurfacePiece piece = surface.piece(id, false);
    for (std::size_t i = 0; i < piece.points.size(); ++i) {
      const SurfaceVertex& v = piece.vertices[i];
      ASSERT_NEAR(lengths[piece.points[i]], std::hypot(v.x, v.y, v.z), 1e-4);
      if (surface.surface(piece.points[i]) == Surface::inside) points += unknown[piece.points[i]] == float(least);
    }
  }
  EXPECT_GT(points, 100u);
}

// Those of the mesh itself, whatever is shown of it.
TEST(PointValues, AreThoseOfTheMesh) {
  const auto volume = testing::build_shared(testing::stretched(testing::digits({13, 9, 10}, 5)), {.range = {3, 5.5}});
  StreamPlan plan(volume);
  auto client = StreamClient::start(volume->description());
  ASSERT_TRUE(client);
  plan.set_lod({});
  while (const auto batch = plan.next(4096)) ASSERT_TRUE(client->apply(batch->payload));
  BoundarySurface surface(client->front());
  for (const std::uint64_t share : {4, 2, 3}) {
    client->set_budget({.max_tets = volume->description().full.tets * share / 4}, 0);
    (void)surface.update();
    const Mesh mesh = client->mesh();
    std::map<std::array<double, 3>, std::array<float, 3>> expected;  // by place: of a point inside, on alpha and on beta
    for (std::size_t i = 0; i < mesh.points.size(); ++i) expected[mesh.points[i]][std::size_t(mesh.surface[i])] = float(mesh.value[i]);
    const std::vector<float> values = point_values(surface);
    const TetsInBox tets = tets_in_box(surface, {{-100, -100, -100}, {100, 100, 100}}, UINT64_MAX);
    ASSERT_EQ(tets.count, mesh.tets.size());
    const Affine& affine = volume->description().grid.affine;
    for (const PointId id : tets.points) {
      const auto& p = surface.position(id);
      constexpr double kStep = 1.0 / FrontMesher::kSteps;
      const auto found = expected.find(affine.point({p[0] * kStep, p[1] * kStep, p[2] * kStep}));
      ASSERT_NE(found, expected.end());
      ASSERT_EQ(values[id], found->second[std::size_t(surface.surface(id))]);
    }
  }
}

}  // namespace
}  // namespace intervale
