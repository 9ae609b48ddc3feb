// The server's side of a session; its client's side and what both do together: client_session_test.cpp.
#include "protocol/session/session_state.h"

#include <gtest/gtest.h>

#include "common/mesh/mesh_digest.h"

#include <memory>
#include <semaphore>

#include "client/core/client_session.h"
#include "protocol/session/local_worker.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/session_server.h"

namespace intervale {
namespace {

using protocol::CloseCode;

TEST(SessionState, EndsASessionForBatchesOfAnotherVersion) {
  LocalWorker worker;
  const struct {
    std::uint32_t payload;
    const char* text;
  } cases[] = {{0, "the client reads batches of version 1, and this server sends version 4: update the client"},
               {1, "the client reads batches of version 1, and this server sends version 4: update the client"},
               {5, "the client reads batches of version 5, and this server sends version 4: update the server"}};
  for (const auto& c : cases) {
    SessionState state([](const std::string&) { return tl::unexpected(protocol::Fault{CloseCode::no_such_dataset, ""}); }, worker);
    const auto fault = state.receive(protocol::Open{.dataset = "made", .payload = c.payload});
    ASSERT_TRUE(fault);
    EXPECT_EQ(fault->code, CloseCode::other_version);
    EXPECT_EQ(fault->text, c.text);
    EXPECT_FALSE(state.opened());
  }
}

// A client that looks through a camera at a range of a data set, while the server's measuring of distances waits.
struct MeasuredLate : ::testing::Test {
  std::shared_ptr<const IntervalVolume> volume = testing::build_shared(testing::gyroid({33, 33, 33}), {.range = {-1, 1}, .refine = Refine::uniform});
  std::counting_semaphore<> may_measure{0};
  ClientSession session{{.dataset = "made", .client = "test"}};
  testing::SessionServer<ClientSession> server{volume, session, [this](PartFinder& finder, const RangePart& part) {
                                                 if (part.distances == Distances::measured) may_measure.acquire();
                                                 return finder.find(part);
                                               }};
  static ViewRequest view_of(Range range, bool early) {
    ViewRequest view;
    view.lod.camera = Camera{.eye = {80, 60, 50}, .look_at = {16, 16, 16}, .viewport = {640, 480}, .pixel_error = 1};
    view.shown = {{range}, Refine::boundary};
    view.early = early;
    return view;
  }
  void run_while_it_waits() { server.run(1 << 20, false); }
};

TEST_F(MeasuredLate, AnEarlyViewBeginsWithEstimatesAndEndsWhenAllIsKnown) {
  ASSERT_TRUE(session.look(view_of({-0.3, 0.2}, true)));
  run_while_it_waits();
  const std::uint64_t early = session.mesh()->updates();
  EXPECT_GT(early, 100u);
  EXPECT_EQ(session.state(), ClientSession::State::viewing) << "Done comes from what is measured";
  EXPECT_EQ(session.stats().remaining_pixels, 1) << "what is not measured may be missing";
  may_measure.release(2);
  server.run();
  EXPECT_EQ(session.state(), ClientSession::State::idle);
  EXPECT_GT(session.mesh()->updates(), early);
  ASSERT_TRUE(session.look(view_of({-0.3, 0.2}, true)));
  run_while_it_waits();
  EXPECT_EQ(session.state(), ClientSession::State::idle) << "it is known by now";
}

// What is seen comes first; the mesh at the end is the same. (Not for an early view: how much its estimates send too much
// depends on how long the measuring takes.)
TEST_F(MeasuredLate, AnOpaqueViewTellsWhatItsSurfacesHide) {
  may_measure.release(100);
  ViewRequest view = view_of({-0.3, 0.2}, false);
  view.lod.camera->pixel_error = 0.1;
  ASSERT_TRUE(session.look(view));
  server.run();
  const std::uint64_t updates = session.mesh()->updates();
  const std::uint64_t epochs = session.epoch();

  ClientSession opaque{{.dataset = "made", .client = "test"}};
  testing::SessionServer<ClientSession> other{volume, opaque};
  view.is_opaque = true;
  ASSERT_TRUE(opaque.look(view));
  std::uint64_t told = 0, due = kDepthMapUpdates;
  for (int step = 0; step < 1000 && opaque.state() != ClientSession::State::idle; ++step) {
    other.run(1);
    EXPECT_EQ(opaque.wants_depth_map(), opaque.state() == ClientSession::State::viewing && opaque.mesh()->updates() >= due);
    if (!opaque.wants_depth_map()) continue;
    ++told;
    due = 2 * opaque.mesh()->updates();
    DepthBuffer buffer(*view.lod.camera);
    buffer.draw({Vec3{16, -1000, -1000}, Vec3{16, 2000, -1000}, Vec3{16, 0, 2000}});
    opaque.send_depth_map(buffer.map());
  }
  EXPECT_EQ(opaque.state(), ClientSession::State::idle);
  EXPECT_GE(told, 2u);
  EXPECT_EQ(opaque.epoch(), epochs + told);
  EXPECT_EQ(opaque.mesh()->updates(), updates);
  EXPECT_EQ(mesh_digest(opaque.mesh()->mesh()), mesh_digest(session.mesh()->mesh()));
}

// In another order; and once the camera has rested, in that of the view itself.
TEST_F(MeasuredLate, WhereTheCameraGoesChangesNothingInTheEnd) {
  may_measure.release(100);
  ViewRequest view = view_of({-0.3, 0.2}, false);
  view.lod.camera->pixel_error = 0.1;
  ASSERT_TRUE(session.look(view));
  server.run();
  const auto digest = mesh_digest(session.mesh()->mesh());

  for (const int milliseconds : {10, 1 << 20}) {  // the server's messages are one millisecond apart
    ClientSession moving{{.dataset = "made", .client = "test"}};
    testing::SessionServer<ClientSession> other{volume, moving};
    Camera camera = *view.lod.camera;
    camera.eye[1] += 10;
    view.ahead = CameraAhead{camera, ClientSession::Clock::time_point(std::chrono::milliseconds(milliseconds))};
    ASSERT_TRUE(moving.look(view));
    other.run();
    EXPECT_EQ(moving.state(), ClientSession::State::idle);
    EXPECT_EQ(mesh_digest(moving.mesh()->mesh()), digest);
    std::vector<bool> goes;
    for (const auto& message : other.received()) {
      if (const auto* sent = std::get_if<protocol::View>(&message)) goes.push_back(sent->ahead.has_value());
    }
    EXPECT_EQ(goes, milliseconds == 10 ? std::vector<bool>({true, false}) : std::vector<bool>({true}));
  }
}

TEST_F(MeasuredLate, OtherViewsWait) {
  ASSERT_TRUE(session.look(view_of({-0.3, 0.2}, false)));
  run_while_it_waits();
  EXPECT_EQ(session.mesh()->updates(), 0u);
  ViewRequest all = view_of({-0.3, 0.2}, false);
  all.lod = {.error_percent = 50};
  ASSERT_TRUE(session.look(all));
  run_while_it_waits();
  EXPECT_EQ(session.state(), ClientSession::State::idle) << "without a camera nothing has to be measured";
  may_measure.release(2);
}

// A client that has all that the estimates find is told so at once, and by Done when it is certain.
TEST_F(MeasuredLate, AnEarlyViewThatLacksNothingIsAnsweredAtOnce) {
  ViewRequest all = view_of({-1, 1}, true);
  all.shown.refine = Refine::uniform;
  all.lod = {};
  ASSERT_TRUE(session.look(all));
  run_while_it_waits();
  ASSERT_EQ(session.state(), ClientSession::State::idle);
  const std::uint64_t updates = session.mesh()->updates(), messages = session.stats().messages;
  ASSERT_TRUE(session.look(view_of({-0.3, 0.2}, false)));
  run_while_it_waits();
  EXPECT_EQ(session.stats().messages, messages) << "this one does not take estimates";
  ASSERT_TRUE(session.look(view_of({-0.3, 0.2}, true)));
  run_while_it_waits();
  EXPECT_EQ(session.stats().messages, messages + 1);
  EXPECT_EQ(session.state(), ClientSession::State::viewing);
  EXPECT_EQ(session.stats().updates_to_go, 0u);
  EXPECT_EQ(session.stats().remaining_pixels, 1);
  may_measure.release(2);
  server.run();
  EXPECT_EQ(session.state(), ClientSession::State::idle);
  EXPECT_EQ(session.stats().remaining_pixels, 0);
  EXPECT_EQ(session.stats().messages, messages + 2);
  EXPECT_EQ(session.mesh()->updates(), updates);
}

// A range that was left is not measured, if its turn had not come; the end that was not dragged is known.
TEST_F(MeasuredLate, ADragIsMeasuredWhereItRests) {
  for (const double alpha : {-0.4, -0.35, -0.3, -0.25}) {
    ASSERT_TRUE(session.look(view_of({alpha, 0.2}, true)));
    run_while_it_waits();
  }
  may_measure.release(2 + 1);
  server.run();
  EXPECT_EQ(session.state(), ClientSession::State::idle);
  EXPECT_FALSE(may_measure.try_acquire()) << "the first range was being measured, and then the lower surface of the last";
}

}  // namespace
}  // namespace intervale
