// The values at a point are those that the mesh interpolates there, on the finest tetrahedra that the client shows.
#include "client/view/values_at.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "common/mesh/mesh.h"
#include "common/selection/stream_plan.h"
#include "tests/support/channels.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/value_fields.h"

namespace intervale::values_at_points {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
using Dims = std::array<std::int32_t, 3>;

// Everything is in the range, so that the mesh has all of each tetrahedron.
struct Data {
  explicit Data(const Dims& dims, unsigned seed) : field(testing::stretched(testing::random_value_field(dims, seed).volume)) {
    IntervalVolume made = testing::build(field, {.range = {-kInf, kInf}, .refine = Refine::uniform});
    testing::set_channels(made, seed);
    volume = std::make_shared<const IntervalVolume>(std::move(made));
  }
  Volume field;
  std::shared_ptr<const IntervalVolume> volume;
};

TEST(ValuesAt, AreThoseThatTheMeshInterpolates) {
  std::mt19937 random(1);
  for (const Dims& dims : {Dims{17, 17, 17}, Dims{13, 9, 10}, Dims{3, 30, 5}, Dims{2, 2, 2}}) {
    const Data data(dims, 3);
    StreamPlan plan(data.volume);
    plan.set_channels(std::vector<std::size_t>{0, 1});
    plan.set_lod({});
    auto client = StreamClient::start(data.volume->description());
    ASSERT_TRUE(client);
    client->show_channels({0, 1});
    do {
      const Mesh mesh = client->mesh();
      for (int n = 0; n < 200; ++n) {
        const auto& tet = mesh.tets[random() % mesh.tets.size()];
        const bool is_vertex = n % 4 == 0;
        std::array<double, 4> weight{};
        double sum = 0;
        for (double& w : weight) sum += w = is_vertex ? double(&w == &weight[1]) : double(random());
        Vec3 at{};
        ValuesAt wanted{0, {0, 0}};
        Vec3 place{};
        for (std::size_t i = 0; i < 4; ++i) {
          const double share = weight[i] / sum;
          const std::array<double, 3>& point = mesh.points[tet[i]];
          const double* const places = &mesh.channels[1].value[3 * std::size_t(tet[i])];
          for (std::size_t k = 0; k < 3; ++k) {
            at[k] += share * point[k];
            place[k] += share * places[k];
          }
          wanted.field += share * mesh.value[tet[i]];
          wanted.channels[0] += share * mesh.channels[0].value[tet[i]];
        }
        wanted.channels[1] = length(place);
        const auto found = values_at(*client, at);
        ASSERT_TRUE(found);
        ASSERT_NEAR(found->field, wanted.field, 1e-9 * (1 + std::abs(wanted.field)))
            << "of " << dims[0] << " x " << dims[1] << " x " << dims[2] << ", " << is_vertex;
        ASSERT_EQ(found->channels.size(), 2U);
        for (std::size_t c = 0; c < 2; ++c) ASSERT_NEAR(found->channels[c], wanted.channels[c], 1e-6);
      }
      const auto batch = plan.next(700);
      if (!batch) break;
      ASSERT_TRUE(client->apply(batch->payload, 0, {}, {batch->channels, std::vector<std::size_t>{0, 1}}));
    } while (true);
  }
}

}  // namespace
}  // namespace intervale::values_at_points
