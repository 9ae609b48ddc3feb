#include "client/view/viewing_session.h"

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <random>

#include "client/view/coarse_front.h"
#include "common/ivm/extraction.h"
#include "common/ivm/ivm_file.h"
#include "protocol/codec.h"
#include "tests/support/cameras.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/mesh_laws.h"
#include "tests/support/session_server.h"

namespace intervale {
namespace {

using testing::canonical;
using ViewingServer = testing::SessionServer<ViewingSession>;

std::shared_ptr<const IntervalVolume> volume_of(const testing::Dims& dims) {
  return testing::build_shared(testing::gyroid(dims), {.range = {-0.3, 0.2}});
}

const Camera kSessionCamera{.eye = {40, 30, 60}, .look_at = {8, 8, 8}, .viewport = {640, 480}};
const Box kAll{{-1, -1, -1}, {100, 100, 100}};

struct ViewingSessionTest : ::testing::Test {
  std::shared_ptr<const IntervalVolume> volume = volume_of({17, 17, 17});
  ViewingSession session{"made", "test"};
};

TEST_F(ViewingSessionTest, RefinesARegionToTheEnd) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll}));
  ViewingServer server(volume, session);
  server.run();
  EXPECT_TRUE(session.is_done());
  EXPECT_FALSE(session.session().stats().is_full);
  EXPECT_EQ(session.session().stats().updates, volume->size());
  EXPECT_EQ(canonical(session.mesh()->mesh()), canonical(extract(*volume, {})->front.mesh()));
}

TEST_F(ViewingSessionTest, RefinesEachViewAsFarAsItIsSeen) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera}));
  ViewingServer server(volume, session);
  server.run();
  EXPECT_TRUE(session.is_done());
  const auto before = session.session().stats().updates;
  EXPECT_LT(before, volume->size());
  Camera near = kSessionCamera;
  near.eye = {12, 12, 20};
  ASSERT_TRUE(session.look({.camera = near}));
  EXPECT_FALSE(session.is_done());
  server.run();
  EXPECT_TRUE(session.is_done());
  EXPECT_GT(session.session().stats().updates, before);
  EXPECT_EQ(session.session().stats().updates, session.mesh()->updates());
}

TEST_F(ViewingSessionTest, TellsWhereTheCameraGoesWhileItMoves) {
  const auto now = ViewingSession::Clock::now();
  Camera camera = kSessionCamera;
  ASSERT_TRUE(session.look({.camera = camera}, {}, now));
  ViewingServer server(volume, session);
  server.run();
  const auto look_at_last = [&](std::chrono::milliseconds later) {
    camera.eye[0] += 1;
    EXPECT_TRUE(session.look({.camera = camera}, {}, now + later));
    server.run();
    return std::get<protocol::View>(server.received().back());
  };
  const protocol::View moved = look_at_last(std::chrono::milliseconds(100));
  ASSERT_TRUE(moved.ahead);
  EXPECT_GT(moved.ahead->eye[0], camera.eye[0] + 1);
  EXPECT_EQ(moved.lod.camera, camera);
  EXPECT_FALSE(look_at_last(std::chrono::seconds(10)).ahead) << "it has rested";
}

TEST_F(ViewingSessionTest, DoesNotAskForTheSameViewAgain) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera}));
  ViewingServer server(volume, session);
  server.run();
  ASSERT_TRUE(session.look({.camera = kSessionCamera}));
  EXPECT_TRUE(session.take_messages().empty());
  EXPECT_TRUE(session.is_done());
}

TEST_F(ViewingSessionTest, ResumesWithNothingSentTwice) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll}));
  for (int k = 0; k < 3; ++k) {
    ViewingServer server(volume, session);
    server.run(3);
    EXPECT_EQ(server.resumed(), k > 0);
    session.disconnected();
  }
  ViewingServer server(volume, session);
  server.run();
  EXPECT_TRUE(server.resumed());
  EXPECT_TRUE(session.is_done());
  EXPECT_EQ(session.session().stats().updates, volume->size());
  EXPECT_EQ(canonical(session.mesh()->mesh()), canonical(extract(*volume, {})->front.mesh()));
}

TEST_F(ViewingSessionTest, StartsAgainWithOtherData) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll}));
  {
    ViewingServer server(volume, session);
    server.run(3);
    session.disconnected();
  }
  const auto other = std::make_shared<const IntervalVolume>(decode_ivm(encode_ivm(*volume_of({12, 20, 9})), volume->description().name).value());
  ViewingServer server(other, session);
  server.run();
  EXPECT_EQ(session.session().stats().updates, other->size());
  EXPECT_FALSE(server.resumed());
}

TEST_F(ViewingSessionTest, KeepsTheBudgetOfTetrahedraAtEveryMoment) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll, .budget = {.max_tets = 3000}}));
  ViewingServer server(volume, session);
  for (int k = 0; k < 1000 && !session.is_done(); ++k) {
    server.run(1);
    ASSERT_TRUE(session.mesh()->tet_count() <= 3000);
  }
  EXPECT_EQ(session.mesh()->updates(), volume->size()) << "all is kept";
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll}));
  EXPECT_EQ(session.mesh()->tet_count(), volume->description().full.tets) << "and shown when there is room";
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll, .budget = {.max_tets = 2000}}));
  EXPECT_LE(session.mesh()->tet_count(), 2000u);
}

TEST_F(ViewingSessionTest, KeepsTheRoomForUpdatesWhichMayChange) {
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll, .budget = {.max_updates = 1000}}));
  ViewingServer server(volume, session);
  server.run();
  EXPECT_TRUE(session.is_done());
  EXPECT_TRUE(session.session().stats().is_full);
  EXPECT_LE(session.mesh()->updates(), 1000u);
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = kAll, .budget = {.max_updates = 2000}}));
  server.run();
  EXPECT_GT(session.mesh()->updates(), 1000u);
  EXPECT_LE(session.mesh()->updates(), 2000u);
  for (int k = 0; k < 4; ++k) {  // less, seen from elsewhere each time
    Camera camera = kSessionCamera;
    camera.eye[k % 3] += 5 * k + 5;
    ASSERT_TRUE(session.look({.camera = camera, .region = kAll, .budget = {.max_updates = 1100}}));
    server.run();
  }
  EXPECT_LE(session.mesh()->updates(), 1100u);
}

// Within the samples of a grid, or reaching a little beyond.
Box random_region_of_view(const Grid& grid, std::mt19937& random) {
  Box region;
  for (std::size_t i = 0; i < 3; ++i) {
    const double side = box_of(grid).max[i] - box_of(grid).min[i];
    region.min[i] = box_of(grid).min[i] + testing::uniform(random, -0.1, 0.8) * side;
    region.max[i] = region.min[i] + testing::uniform(random, 0.05, 0.5) * side;
  }
  return region;
}

// Views before it do not matter; and what they received is shown again after it, without being sent again.
TEST(RegionOfAView, ShowsTheMeshOfAClientThatAskedForTheRegionOnly) {
  for (const unsigned seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto volume = volume_of({33, 21, 17});
    ViewingSession session("made", "test");
    ASSERT_TRUE(session.look({.camera = kSessionCamera}));
    ViewingServer server(volume, session);
    server.run();
    for (int k = 0; k < 4; ++k) {
      const WantedView view{.camera = kSessionCamera, .region = random_region_of_view(volume->description().grid, random)};
      ASSERT_TRUE(session.look(view));
      server.run(k);  // a view may come before the last one is complete
      if (k % 2 == 1) continue;
      server.run();
      ViewingSession fresh("made", "test");
      ASSERT_TRUE(fresh.look(view));
      ViewingServer its_server(volume, fresh);
      its_server.run();
      ASSERT_EQ(canonical(session.mesh()->mesh()), canonical(fresh.mesh()->mesh()));
      ASSERT_EQ(session.mesh()->front().validate(), std::nullopt);
      EXPECT_GT(session.mesh()->updates(), fresh.mesh()->updates()) << "what the first view received is kept";
    }
    ASSERT_TRUE(session.look({.camera = kSessionCamera}));
    server.run();
    EXPECT_EQ(session.mesh()->updates_left_out(), 0u);
    EXPECT_EQ(session.session().stats().updates, session.mesh()->updates()) << "nothing is sent twice";
    EXPECT_EQ(canonical(session.mesh()->mesh()), canonical(coarse_front(*session.mesh(), 0).mesh())) << "all is shown again";
  }
}

// Of every range, one of several ranges changes while there is a region; then updates of any range follow, ahead.
TEST(RegionOfAView, HoldsForEachOfSeveralRanges) {
  const auto volume = testing::build_shared(testing::gyroid({33, 33, 33}), {.range = {-1, 1}, .refine = Refine::uniform});
  const RangeRequest one{.ranges = {{-0.3, 0.2}, {0.4, 0.6}}}, other{.ranges = {{-0.3, 0.2}, {0.3, 0.7}}};
  ViewingSession session("made", "test");
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .shown = one}));
  ViewingServer server(volume, session);
  server.run();
  const Box region{{3, 4, 5}, {14, 12, 13}};
  for (const RangeRequest& shown : {one, other}) {
    const WantedView view{.camera = kSessionCamera, .region = region, .shown = shown};
    ASSERT_TRUE(session.look(view));
    server.run();
    ViewingSession fresh("made", "test");
    ASSERT_TRUE(fresh.look(view));
    ViewingServer its_server(volume, fresh);
    its_server.run();
    EXPECT_EQ(canonical(session.mesh()->mesh()), canonical(fresh.mesh()->mesh()));
  }
}

TEST(RegionOfAView, KeepsTheBudgetOfTetrahedra) {
  const auto volume = volume_of({17, 17, 17});
  ViewingSession session("made", "test");
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .budget = {.max_tets = 3000}}));
  ViewingServer server(volume, session);
  server.run();
  ASSERT_TRUE(session.look({.camera = kSessionCamera, .region = Box{{2, 2, 2}, {12, 12, 12}}, .budget = {.max_tets = 3000}}));
  for (int k = 0; k < 1000 && !session.is_done(); ++k) {
    server.run(1);
    ASSERT_LE(session.mesh()->tet_count(), 3000u);
  }
  EXPECT_EQ(session.mesh()->front().validate(), std::nullopt);
}

TEST_F(ViewingSessionTest, InvalidMessagesAndFaultsEndIt) {
  EXPECT_FALSE(session.look({.camera = {.eye = {1, 1, 1}, .look_at = {1, 1, 1}}}));
  EXPECT_FALSE(session.look({.camera = kSessionCamera, .budget = {.max_updates = 1}}));
  ASSERT_TRUE(session.look({.camera = kSessionCamera}));
  session.connected({});
  EXPECT_FALSE(session.receive(std::vector<std::uint8_t>{1, 2, 3}, {}));
  ViewingSession early("made", "test");
  ASSERT_TRUE(early.look({.camera = kSessionCamera}));
  early.connected({});
  EXPECT_FALSE(early.receive(protocol::encode(protocol::ServerMessage(protocol::Done{1, 0, false})), {}));
  ViewingSession refused("nothing", "test");
  ASSERT_TRUE(refused.look({.camera = kSessionCamera}));
  refused.connected({});
  const auto taken =
      refused.receive(protocol::encode(protocol::ServerMessage(protocol::Fault{protocol::CloseCode::no_such_dataset, "no\nsuch"})), {});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().message.find('\n'), std::string::npos);
  EXPECT_EQ(refused.session().fault()->code, protocol::CloseCode::no_such_dataset);
}

}  // namespace
}  // namespace intervale
