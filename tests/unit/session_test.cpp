// A stream without I/O, as programs that embed the client library have it.
#include "client/api/session.h"

#include <gtest/gtest.h>

#include <memory>

#include "common/mesh/mesh_digest.h"
#include "server/api/build.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/session_server.h"

namespace intervale {
namespace {

// A Session, driven like a ClientSession.
struct DrivenSession {
  Session& session;
  void connected(ClientSession::Clock::time_point /*now*/) const { session.connected(); }
  auto take_messages() const { return session.take_messages(); }
  Result<ClientSession::Event> receive(std::span<const std::uint8_t> message, ClientSession::Clock::time_point /*now*/) const {
    if (auto received = session.receive(message); !received) return tl::unexpected(received.error());
    return ClientSession::Event{};
  }
};

TEST(Session, EndsWithTheMeshOfItsLastRequest) {
  const Volume volume = testing::gyroid({17, 20, 15});
  auto shared = testing::build_shared(volume, {.range = {-0.3, 0.2}});
  const auto data_set = build_data_set(volume, {.range = Range{-0.3, 0.2}, .step = 0});
  ASSERT_TRUE(data_set) << data_set.error().message;
  MeshRequest coarse;
  coarse.lod.error_percent = 30;
  auto session = Session::start(shared->description().name, coarse, "test");
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_FALSE(session->info() || session->is_done());
  EXPECT_TRUE(session->mesh().tets.empty());
  DrivenSession driven{*session};
  testing::SessionServer server(shared, driven);
  ASSERT_NO_FATAL_FAILURE(server.run());
  EXPECT_TRUE(session->is_done());
  ASSERT_TRUE(session->info());
  EXPECT_EQ(session->info()->updates, shared->size());
  EXPECT_EQ(mesh_digest(session->mesh()), mesh_digest(*data_set->extract(coarse)));
  const std::uint64_t updates = session->updates();
  EXPECT_GT(updates, 0u);

  MeshRequest other;
  other.channels = {"none"};
  EXPECT_FALSE(session->look(other));
  EXPECT_TRUE(session->is_done());
  ASSERT_TRUE(session->look({}));
  EXPECT_FALSE(session->is_done());
  ASSERT_NO_FATAL_FAILURE(server.run());
  EXPECT_TRUE(session->is_done());
  EXPECT_GT(session->updates(), updates);
  EXPECT_EQ(mesh_digest(session->mesh()), mesh_digest(*data_set->extract()));
}

TEST(Session, RefusesBadRequestsAndMessages) {
  MeshRequest bad;
  bad.shown.ranges = {{1, 0}};
  EXPECT_FALSE(Session::start("x", bad));
  auto session = Session::start("x", {});
  ASSERT_TRUE(session);
  session->connected();
  EXPECT_FALSE(session->take_messages().empty());
  EXPECT_FALSE(session->receive(std::vector<std::uint8_t>{1, 2, 3}));
  EXPECT_FALSE(session->may_reconnect());
}

}  // namespace
}  // namespace intervale
