// A session whose client is in the same place and thread: as that of a server, with all of its work between messages.
#include "protocol/session/local_worker.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <random>

#include "client/core/client_session.h"
#include "common/mesh/mesh_digest.h"
#include "protocol/codec.h"
#include "protocol/session/session_state.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/seeds.h"
#include "tests/support/session_server.h"

namespace intervale {
namespace {

using SharedVolume = std::shared_ptr<const IntervalVolume>;

// Until neither side has anything to send, or it waits for the worker, if that may not work. Returns how often it did.
int run(ClientSession& client, SessionState& state, LocalWorker& worker, bool may_work = true) {
  CreditWindow::Clock::time_point now{};
  int pieces = 0;
  for (int idle = 0; idle < 100'000; ++idle) {
    for (const auto& bytes : client.take_messages()) EXPECT_FALSE(state.receive(protocol::decode_client_message(bytes).value()));
    const auto message = state.next();
    if (message) {
      idle = 0;
      now += std::chrono::milliseconds(1);
      EXPECT_TRUE(client.receive(protocol::encode(*message), now));
    } else if (state.waits()) {
      if (!may_work) return pieces;
      EXPECT_TRUE(worker.work()) << "nothing would wake the session";
      ++pieces;
    } else if (!state.has_work()) {
      return pieces;
    }
  }
  ADD_FAILURE() << "the session has nothing to do, and does not say that it waits";
  return pieces;
}

SessionState::Find always(const SharedVolume& volume) {
  return [volume](const std::string&) -> tl::expected<SharedVolume, protocol::Fault> { return volume; };
}

ViewRequest through_camera(const Range& range, std::optional<std::uint64_t> most, bool early) {
  ViewRequest view;
  view.lod.camera = Camera{.eye = {80, 60, 50}, .look_at = {16, 16, 16}, .viewport = {640, 480}, .pixel_error = 1};
  view.lod.max_updates = most;
  view.shown = {{range}, Refine::boundary};
  view.early = early;
  return view;
}

TEST(LocalWorker, EndsWithTheMeshThatAServerSends) {
  const SharedVolume volume = testing::build_shared(testing::gyroid({33, 30, 25}), {.range = {-1, 1}, .refine = Refine::uniform});
  std::minstd_rand random(20);
  const auto value = [&] { return -1 + 2 * double(random() % 1000) / 999; };
  LocalWorker worker;
  SessionState state(always(volume), worker);
  ClientSession here({.dataset = "made", .client = "test"});
  here.connected({});
  ClientSession there({.dataset = "made", .client = "test"});
  testing::SessionServer<ClientSession> server(volume, there);
  for (unsigned i = 0; i < testing::cases(12); ++i) {
    const double a = value(), b = value();
    const auto most = random() % 3 == 0 ? std::optional<std::uint64_t>(200 + random() % 3000) : std::nullopt;
    const ViewRequest view = through_camera({std::min(a, b), std::max(a, b)}, most, false);
    ASSERT_TRUE(here.look(view));
    ASSERT_TRUE(there.look(view));
    run(here, state, worker);
    ASSERT_NO_FATAL_FAILURE(server.run());
    ASSERT_EQ(here.state(), ClientSession::State::idle);
    ASSERT_EQ(mesh_digest(here.mesh()->mesh()), mesh_digest(there.mesh()->mesh())) << "view " << i;
    ASSERT_EQ(here.mesh()->updates(), there.mesh()->updates());
  }
}

TEST(LocalWorker, MeasuresPieceByPieceAndRemembersWhatItMeasured) {
  const SharedVolume volume = testing::build_shared(testing::gyroid({33, 33, 33}), {.range = {-1, 1}, .refine = Refine::uniform});
  LocalWorker worker;
  SessionState state(always(volume), worker);
  ClientSession client({.dataset = "made", .client = "test"});
  client.connected({});
  ASSERT_TRUE(client.look(through_camera({-0.3, 0.2}, {}, true)));
  run(client, state, worker, false);
  EXPECT_GT(client.mesh()->updates(), 100u) << "an early view begins with estimates";
  EXPECT_EQ(client.state(), ClientSession::State::viewing);
  EXPECT_EQ(run(client, state, worker), 2) << "one for each surface";
  EXPECT_EQ(client.state(), ClientSession::State::idle);
  ASSERT_TRUE(client.look(through_camera({-0.4, 0.2}, {}, true)));
  EXPECT_EQ(run(client, state, worker), 1) << "the upper surface is known";
  ASSERT_TRUE(client.look(through_camera({-0.3, 0.2}, {}, true)));
  EXPECT_EQ(run(client, state, worker), 0);
  EXPECT_FALSE(worker.work());
}

// Its own part only, as if that were all that there is room for.
TEST(LocalWorker, FinishesARangeThatIsLargerThanWhatItKeeps) {
  const SharedVolume volume = testing::build_shared(testing::gyroid({17, 17, 17}), {.range = {-1, 1}, .refine = Refine::uniform});
  LocalWorker worker(1);
  SessionState state(always(volume), worker);
  ClientSession client({.dataset = "made", .client = "test"});
  client.connected({});
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(client.look(through_camera({-0.3, 0.2 + 0.1 * i}, {}, true)));
    EXPECT_EQ(run(client, state, worker), 2);
    EXPECT_EQ(client.state(), ClientSession::State::idle);
  }
}

}  // namespace
}  // namespace intervale
