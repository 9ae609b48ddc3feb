#include "client/view/viewing_session.h"

#include <gtest/gtest.h>

#include <deque>
#include <memory>

#include "common/ivm/extraction.h"
#include "protocol/codec.h"
#include "server/builder/field_hierarchy.h"
#include "server/serve/access.h"
#include "server/serve/atomic_shared_ptr.h"
#include "server/serve/session_state.h"
#include "tests/support/analytic_fields.h"
#include "tests/support/mesh_laws.h"

namespace intervale {
namespace {

using testing::canonical;
using Clock = ViewingSession::Clock;

Catalogue catalogue_of(Volume volume) {
  Catalogue catalogue;
  auto sigma = FieldHierarchy(volume, {.range = {-0.3, 0.2}}).compact();
  EXPECT_TRUE(sigma);
  EXPECT_TRUE(catalogue.add(std::make_shared<const IntervalVolume>(std::move(*sigma))));
  return catalogue;
}

// A server at the other end of a line that carries a message at once, or breaks.
class Line {
 public:
  Line(const Catalogue& catalogue, ViewingSession& client) : client_(client) {
    catalogue_.store(std::make_shared<const Catalogue>(catalogue));
    client_.opened_line(now_);
  }
  // Until neither has anything to say, or so many messages came from the server.
  void run(int messages = 1 << 20) {
    while (messages > 0) {
      for (const auto& bytes : client_.take_messages()) {
        const auto message = protocol::decode_client_message(bytes);
        ASSERT_TRUE(message) << message.error().message;
        const auto fault = server_.receive(*message);
        ASSERT_FALSE(fault) << fault->text;
      }
      auto message = server_.next(2048);
      if (!message && server_.has_work()) continue;
      if (!message) return;
      now_ += std::chrono::milliseconds(1);
      const auto taken = client_.receive(protocol::encode(*message), now_);
      ASSERT_TRUE(taken) << taken.error().message;
      --messages;
    }
  }
  SessionState& server() { return server_; }

 private:
  AtomicSharedPtr<Catalogue> catalogue_;
  SessionState server_{catalogue_, Scope::everything()};
  ViewingSession& client_;
  Clock::time_point now_{};
};

const Camera kCamera{.eye = {40, 30, 60}, .look_at = {8, 8, 8}, .viewport = {640, 480}};
const Box kAll{{-1, -1, -1}, {100, 100, 100}};

struct Viewing : ::testing::Test {
  Catalogue catalogue = catalogue_of(testing::gyroid({17, 17, 17}));
  std::shared_ptr<const IntervalVolume> volume = catalogue.find("made");
  ViewingSession session{"made", "test"};
};

TEST_F(Viewing, ARegionComesToTheEnd) {
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll}));
  Line line(catalogue, session);
  line.run();
  EXPECT_TRUE(session.figures().done);
  EXPECT_FALSE(session.figures().full);
  EXPECT_EQ(session.figures().received, volume->size());
  EXPECT_EQ(canonical(session.client()->mesh()), canonical(extract(*volume, {})->front.mesh()));
}

TEST_F(Viewing, AViewComesAsFarAsItIsSeenAndANewOneGoesOn) {
  ASSERT_TRUE(session.look({.camera = kCamera}));
  Line line(catalogue, session);
  line.run();
  EXPECT_TRUE(session.figures().done);
  const auto before = session.figures().received;
  EXPECT_LT(before, volume->size());
  Camera near = kCamera;
  near.eye = {12, 12, 20};
  ASSERT_TRUE(session.look({.camera = near}));
  EXPECT_FALSE(session.figures().done);
  line.run();
  EXPECT_TRUE(session.figures().done);
  EXPECT_GT(session.figures().received, before);
  EXPECT_EQ(session.figures().received, session.client()->updates());
}

TEST_F(Viewing, TheSameViewAgainIsNotAsked) {
  ASSERT_TRUE(session.look({.camera = kCamera}));
  Line line(catalogue, session);
  line.run();
  ASSERT_TRUE(session.look({.camera = kCamera}));
  EXPECT_TRUE(session.take_messages().empty());
  EXPECT_TRUE(session.figures().done);
}

TEST_F(Viewing, ALostLineGoesOnWithNothingSentTwice) {
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll}));
  for (int k = 0; k < 3; ++k) {
    Line line(catalogue, session);
    line.run(3);
    session.lost_line();
  }
  Line line(catalogue, session);
  line.run();
  EXPECT_TRUE(session.figures().done);
  EXPECT_EQ(session.figures().received, volume->size());
  EXPECT_EQ(session.figures().resumed, 3u);
  EXPECT_EQ(canonical(session.client()->mesh()), canonical(extract(*volume, {})->front.mesh()));
}

TEST_F(Viewing, OtherDataStartsAfresh) {
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll}));
  {
    Line line(catalogue, session);
    line.run(3);
    session.lost_line();
  }
  const Catalogue other = catalogue_of(testing::gyroid({12, 20, 9}));
  Line line(other, session);
  line.run();
  EXPECT_EQ(session.figures().received, other.find("made")->size());
  EXPECT_EQ(session.figures().resumed, 0u);
}

TEST_F(Viewing, TheBudgetOfTetrahedraHoldsAtEveryMoment) {
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll, .budget = {.max_tets = 3000}}));
  Line line(catalogue, session);
  for (int k = 0; k < 1000 && !session.figures().done; ++k) {
    line.run(1);
    ASSERT_TRUE(session.client()->tet_count() <= 3000);
  }
  EXPECT_EQ(session.client()->updates(), volume->size()) << "all is kept";
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll}));
  EXPECT_EQ(session.client()->tet_count(), volume->description().full.tets) << "and shown when there is room";
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll, .budget = {.max_tets = 2000}}));
  EXPECT_LE(session.client()->tet_count(), 2000u);
}

TEST_F(Viewing, TheRoomForUpdatesHoldsAndCanChange) {
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll, .budget = {.max_updates = 1000}}));
  Line line(catalogue, session);
  line.run();
  EXPECT_TRUE(session.figures().done);
  EXPECT_TRUE(session.figures().full);
  EXPECT_LE(session.client()->updates(), 1000u);
  ASSERT_TRUE(session.look({.camera = kCamera, .region = kAll, .budget = {.max_updates = 2000}}));
  line.run();
  EXPECT_GT(session.client()->updates(), 1000u);
  EXPECT_LE(session.client()->updates(), 2000u);
  for (int k = 0; k < 4; ++k) {  // less, seen from elsewhere each time
    Camera camera = kCamera;
    camera.eye[k % 3] += 5 * k + 5;
    ASSERT_TRUE(session.look({.camera = camera, .region = kAll, .budget = {.max_updates = 1100}}));
    line.run();
  }
  EXPECT_LE(session.client()->updates(), 1100u);
}

TEST_F(Viewing, NonsenseAndFaultsEndIt) {
  EXPECT_FALSE(session.look({.camera = {.eye = {1, 1, 1}, .look_at = {1, 1, 1}}}));
  EXPECT_FALSE(session.look({.camera = kCamera, .budget = {.max_updates = 1}}));
  ASSERT_TRUE(session.look({.camera = kCamera}));
  session.opened_line({});
  EXPECT_FALSE(session.receive(std::vector<std::uint8_t>{1, 2, 3}, {}));
  ViewingSession early("made", "test");
  ASSERT_TRUE(early.look({.camera = kCamera}));
  early.opened_line({});
  EXPECT_FALSE(early.receive(protocol::encode(protocol::ServerMessage(protocol::Done{1, 0, false})), {}));
  ViewingSession refused("nothing", "test");
  ASSERT_TRUE(refused.look({.camera = kCamera}));
  refused.opened_line({});
  const auto taken =
      refused.receive(protocol::encode(protocol::ServerMessage(protocol::Fault{protocol::CloseCode::no_such_dataset, "no\nsuch"})), {});
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().message.find('\n'), std::string::npos);
  EXPECT_EQ(refused.fault_code(), protocol::CloseCode::no_such_dataset);
}

}  // namespace
}  // namespace intervale
