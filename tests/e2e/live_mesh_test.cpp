// The installed client library's connections, over real sockets.
#include "client/api/live_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "client/api/fetch_mesh.h"
#include "common/mesh/mesh_digest.h"
#include "server/api/build.h"
#include "server/serve/catalogue_watcher.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using std::chrono::milliseconds;
using ::testing::HasSubstr;

MeshRequest shown(double low, double high) {
  MeshRequest request;
  request.shown.ranges = {{low, high}};
  return request;
}

std::string url_of(const Server& server, const std::string& name) { return "ws://127.0.0.1:" + std::to_string(server.port()) + "/" + name; }

// The first mesh that has all of the last request.
Result<MeshState> finished(LiveMesh& live) {
  for (int tries = 0; tries < 600; ++tries) {
    auto state = live.wait(milliseconds(100));
    if (!state) return tl::unexpected(state.error());
    if (*state && (*state)->is_done) return **state;
  }
  return fail("not done within a minute");
}

class LiveMeshes : public ::testing::Test {
 public:
  LiveMeshes() : every(build_data_set(testing::gyroid({33, 30, 35})).value()) {
    EXPECT_TRUE(every.save(file));
    server = start({}, file);
  }
  // oneTBB is not instrumented: the thread sanitizer would report false races of its workers.
  const tbb::global_control one_thread{tbb::global_control::max_allowed_parallelism, 1};
  const TempDir folder;
  const std::string file = folder / "every.ivm";
  DataSet every;
  std::unique_ptr<Server> server;
};

TEST_F(LiveMeshes, EndWithTheMeshOfEachRequest) {
  auto live = LiveMesh::connect(url_of(*server, "every"), shown(-0.3, 0.2));
  ASSERT_TRUE(live) << live.error().message;
  EXPECT_EQ(live->info().updates, every.info().updates);
  std::uint64_t bytes = 0;
  for (const auto& [low, high] : {std::pair(-0.3, 0.2), std::pair(0.1, 0.6), std::pair(-9.0, 0.0), std::pair(-0.3, 0.2)}) {
    ASSERT_TRUE(live->look(shown(low, high)));
    const auto state = finished(*live);
    ASSERT_TRUE(state) << state.error().message;
    EXPECT_EQ(mesh_digest(*state->mesh), mesh_digest(*every.extract(shown(low, high)))) << low;
    EXPECT_GE(state->bytes, bytes);
    bytes = state->bytes;
  }
  EXPECT_FALSE(*live->poll());  // nothing changed since
  // What the data set has not is refused at once, and the mesh stays.
  MeshRequest wrong = shown(0, 1);
  wrong.channels = {"none"};
  EXPECT_FALSE(live->look(wrong));
  EXPECT_FALSE(live->look({}));
  EXPECT_FALSE(live->look(shown(1, 0)));
  ASSERT_TRUE(live->look(shown(0, 0.1)));
  EXPECT_TRUE(finished(*live));
}

TEST_F(LiveMeshes, RefineWhileOneLooks) {
  MeshRequest request = shown(-0.3, 0.2);
  const Box box = box_of(every.info().grid);
  request.lod.camera = Camera{.eye = lerp(box.min, box.max, 2), .look_at = lerp(box.min, box.max, 0.5)};
  auto live = LiveMesh::connect(url_of(*server, "every"), request, {.prefetch_ranges = true});
  ASSERT_TRUE(live) << live.error().message;
  std::uint64_t updates = 0;
  for (bool is_done = false; !is_done;) {
    const auto state = live->wait(std::chrono::minutes(1));
    ASSERT_TRUE(state && *state);
    EXPECT_GE((*state)->updates, updates);
    EXPECT_GE(volume_of(*(*state)->mesh), 0);
    updates = (*state)->updates;
    is_done = (*state)->is_done;
  }
  EXPECT_GT(updates, 0u);
}

TEST_F(LiveMeshes, GoOnWhenTheServerIsBack) {
  auto live = LiveMesh::connect(url_of(*server, "every"), shown(-0.3, 0.2));
  ASSERT_TRUE(live) << live.error().message;
  ASSERT_TRUE(finished(*live));
  const std::uint16_t port = server->port();
  server.reset();
  ASSERT_TRUE(live->look(shown(0.1, 0.6)));  // while there is no server
  ServeOptions options;
  options.listen = "127.0.0.1:" + std::to_string(port);
  options.threads = 1;
  auto next = Server::start(options);
  ASSERT_TRUE(next) << next.error().message;
  (*next)->offer(CatalogueWatcher({file}, (*next)->memory()).load().value());
  const auto state = finished(*live);
  ASSERT_TRUE(state) << state.error().message;
  EXPECT_EQ(mesh_digest(*state->mesh), mesh_digest(*every.extract(shown(0.1, 0.6))));
}

TEST_F(LiveMeshes, EndWithOneLineWhereTheServerStaysAway) {
  auto live = LiveMesh::connect(url_of(*server, "every"), shown(-0.3, 0.2), {.reconnect = std::chrono::seconds(0)});
  ASSERT_TRUE(live) << live.error().message;
  ASSERT_TRUE(finished(*live));
  server.reset();
  const auto ended = finished(*live);
  ASSERT_FALSE(ended);
  EXPECT_THAT(ended.error().message, HasSubstr("127.0.0.1"));
  EXPECT_FALSE(live->poll());  // and every time then
  EXPECT_EQ(live->info().updates, every.info().updates);
}

TEST_F(LiveMeshes, MayBeLeftAtAnyMoment) {
  for (int moment = 0; moment < 20; ++moment) {
    auto live = LiveMesh::connect(url_of(*server, "every"), shown(-0.3, 0.2));
    ASSERT_TRUE(live) << live.error().message;
    for (int i = 0; i < moment; ++i) ASSERT_TRUE(live->wait(milliseconds(1)));
    if (moment % 3 == 0) (void)live->look(shown(0, 0.1 * moment));
  }
}

TEST_F(LiveMeshes, SayWhyThereIsNone) {
  const auto complaint = [](const Result<LiveMesh>& live) { return live ? std::string("connected") : live.error().message; };
  EXPECT_THAT(complaint(LiveMesh::connect("http://x", shown(0, 1))), HasSubstr("ws://"));
  EXPECT_THAT(complaint(LiveMesh::connect("ws://127.0.0.1:1", shown(0, 1))), HasSubstr("no data set"));
  EXPECT_THAT(complaint(LiveMesh::connect("ws://127.0.0.1:1/x", shown(0, 1))), HasSubstr("127.0.0.1:1"));
  EXPECT_THAT(complaint(LiveMesh::connect(url_of(*server, "none"), shown(0, 1))), HasSubstr("none"));
  EXPECT_THAT(complaint(LiveMesh::connect(url_of(*server, "every"), {})), HasSubstr("every range"));
  EXPECT_THAT(complaint(LiveMesh::connect(url_of(*server, "every"), shown(2, 1))), HasSubstr("LO <= HI"));
}

TEST_F(LiveMeshes, FetchMeshHasTheSameMesh) {
  int calls = 0;
  FetchMeshOptions options;
  options.on_progress = [&calls](const FetchProgress& progress) {
    ++calls;
    EXPECT_GT(progress.bytes, 0u);
  };
  const auto fetched = fetch_mesh(url_of(*server, "every"), shown(-0.3, 0.2), options);
  ASSERT_TRUE(fetched) << fetched.error().message;
  EXPECT_TRUE(fetched->is_complete);
  EXPECT_GT(calls, 0);
  EXPECT_EQ(mesh_digest(fetched->mesh), mesh_digest(*every.extract(shown(-0.3, 0.2))));
  options.max_bytes = 2000;
  const auto part = fetch_mesh(url_of(*server, "every"), shown(-0.3, 0.2), options);
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_FALSE(part->is_complete);
  EXPECT_LE(part->bytes, 2000u);
  EXPECT_FALSE(fetch_mesh(url_of(*server, "none"), shown(0, 1)));
  const auto list = list_data_sets("ws://127.0.0.1:" + std::to_string(server->port()));
  ASSERT_TRUE(list) << list.error().message;
  EXPECT_THAT(*list, HasSubstr("\"every\""));
}

}  // namespace
}  // namespace intervale
