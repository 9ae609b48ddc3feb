#include "client/core/client_session.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>

#include "protocol/codec.h"
#include "tests/support/interval_volumes.h"
#include "tests/support/session_server.h"

namespace intervale {
namespace {

using protocol::CloseCode, protocol::Done, protocol::Fault, protocol::Opened;
using State = ClientSession::State;

using Server = testing::SessionServer<ClientSession>;

std::shared_ptr<const IntervalVolume> volume_of(std::int32_t side) {
  return testing::build_shared(testing::gyroid({side, side, side}), {.range = {-0.3, 0.2}});
}

const ClientSession::Options kOptions{.dataset = "made", .client = "test"};

TEST(ClientSession, GoesThroughTheStatesOfTheProtocol) {
  ClientSession session(kOptions);
  session.look({.lod = {.error_percent = 50}});
  EXPECT_EQ(session.state(), State::connecting);
  EXPECT_FALSE(session.has_messages());
  Server server(volume_of(9), session);
  EXPECT_EQ(session.state(), State::greeted);
  server.run(1);
  EXPECT_EQ(session.state(), State::viewing);
  server.run();
  EXPECT_EQ(session.state(), State::idle);
  session.look({});
  EXPECT_EQ(session.state(), State::viewing);
  EXPECT_EQ(session.epoch(), 2u);
  server.run();
  EXPECT_EQ(session.state(), State::idle);
  session.disconnected();
  EXPECT_EQ(session.state(), State::connecting);
}

TEST(ClientSession, WithoutAViewOnlyAsksForTheDescription) {
  ClientSession session(kOptions);
  Server server(volume_of(9), session);
  server.run();
  EXPECT_EQ(server.received().size(), 1u);
  EXPECT_EQ(session.state(), State::idle);
  EXPECT_EQ(session.description()->name, "made");
}

TEST(ClientSession, ResumesWithEverythingItHas) {
  const auto volume = volume_of(49);
  ClientSession session(kOptions);
  session.look({});
  {
    Server server(volume, session);
    server.run(1 << 20);
    session.disconnected();
  }
  ASSERT_EQ(session.stats().updates, volume->size());
  Server server(volume, session);
  server.run();
  ASSERT_GE(server.received().size(), 4u) << "Open, two Haves at least, View";
  EXPECT_EQ(std::get<protocol::Open>(server.received().front()).resume, volume->description().content_hash);
  for (std::size_t i = 1; i + 1 < server.received().size(); ++i) {
    EXPECT_LE(std::get<protocol::Have>(server.received()[i]).splits.size(), protocol::kMaxHave);
  }
  EXPECT_EQ(std::get<protocol::View>(server.received().back()).epoch, 2u) << "epochs grow over all connections";
  EXPECT_EQ(session.state(), State::idle);
  EXPECT_EQ(session.stats().updates, volume->size()) << "nothing is sent twice";
}

TEST(ClientSession, WithoutAMeshCountsTheSameUpdates) {
  const auto volume = volume_of(17);
  ClientSession::Options options = kOptions;
  options.has_mesh = false;
  ClientSession session(options);
  session.look({});
  Server server(volume, session);
  server.run();
  EXPECT_EQ(session.state(), State::idle);
  EXPECT_EQ(session.stats().updates, volume->size());
  EXPECT_EQ(session.mesh(), nullptr);
}

TEST(ClientSession, ReceivesNoMoreThanMaxBytes) {
  const auto volume = volume_of(17);
  std::uint64_t least = 0;
  for (const std::uint64_t most : {0, 2000, 5000, 10000, 1 << 20}) {
    ClientSession::Options options = kOptions;
    options.max_bytes = most;
    ClientSession session(options);
    session.look({});
    Server server(volume, session);
    server.run(1);
    least = session.stats().bytes;
    for (int k = 0; k < 100 && !session.is_exhausted(); ++k) server.run(1);
    EXPECT_LE(session.stats().bytes, std::max(most, least));
    EXPECT_EQ(session.stats().updates == volume->size(), most == 1 << 20);
  }
}

TEST(ClientSession, FaultsTellWhetherConnectingAgainMayHelp) {
  for (const CloseCode code : {CloseCode::going_away, CloseCode::internal, CloseCode::forbidden, CloseCode::timed_out}) {
    ClientSession session(kOptions);
    session.look({});
    session.connected({});
    const auto event = session.receive(protocol::encode(protocol::ServerMessage(Fault{code, "two\nlines"})), {});
    ASSERT_FALSE(event);
    EXPECT_EQ(event.error().message.find('\n'), std::string::npos);
    EXPECT_EQ(session.fault()->code, code);
    EXPECT_EQ(session.state(), may_reconnect(code) ? State::connecting : State::closed);
  }
}

TEST(ClientSession, TellsBothVersionsOfBatches) {
  const struct {
    std::uint32_t payload;
    const char* error;
  } cases[] = {{0, "the server sends batches of version 1, and this client reads version 4: update the server"},
               {1, "the server sends batches of version 1, and this client reads version 4: update the server"},
               {5, "the server sends batches of version 5, and this client reads version 4: update the client"}};
  for (const auto& c : cases) {
    ClientSession session(kOptions);
    session.look({});
    session.connected({});
    const auto event = session.receive(protocol::encode(protocol::ServerMessage(Opened{.description = {}, .limits = {}, .payload = c.payload})), {});
    ASSERT_FALSE(event);
    EXPECT_EQ(event.error().message, c.error);
    EXPECT_EQ(session.state(), State::closed);
  }
}

// A session that has received Opened, all within a credit of 5120 bytes.
struct ClientSessionRefuses : ::testing::Test {
  std::shared_ptr<const IntervalVolume> volume = volume_of(9);
  ClientSession session = [] {
    ClientSession::Options options = kOptions;
    options.window = 4 * protocol::kMinCredit;
    options.has_mesh = false;
    return ClientSession(options);
  }();
  Opened opened{volume->description(), {}, false};

  void SetUp() override {
    session.look({});
    session.connected({});
  }
  bool accepts(const protocol::ServerMessage& message) { return session.receive(protocol::encode(message), {}).has_value(); }
  void expect_refused(const protocol::ServerMessage& message) {
    EXPECT_FALSE(accepts(message));
    EXPECT_EQ(session.state(), State::closed);
    EXPECT_FALSE(session.fault());
    EXPECT_FALSE(std::move(session).take_mesh());
  }
  static protocol::Batch batch(std::uint64_t epoch, std::uint64_t sequence, std::size_t bytes = 10) {
    return {.epoch = epoch, .sequence = sequence, .updates = 1, .payload = std::vector<std::uint8_t>(bytes)};
  }
};

TEST_F(ClientSessionRefuses, ABatchBeforeOpened) { expect_refused(batch(1, 0)); }
TEST_F(ClientSessionRefuses, ADoneBeforeOpened) { expect_refused(Done{1, 0, false}); }
TEST_F(ClientSessionRefuses, ASecondOpened) {
  ASSERT_TRUE(accepts(opened));
  expect_refused(opened);
}
TEST_F(ClientSessionRefuses, AnImpossibleDescription) {
  opened.description.max_error = -1;
  expect_refused(opened);
}
TEST_F(ClientSessionRefuses, ACornerBeyondTheLastValue) {
  opened.description.corners[3] = opened.description.format.last + 1;
  expect_refused(opened);
}
TEST_F(ClientSessionRefuses, AStepThatIsNoNumber) {
  opened.description.format.step = std::numeric_limits<double>::quiet_NaN();
  expect_refused(opened);
}
TEST_F(ClientSessionRefuses, BatchesOfAnotherVersion) {
  opened.payload = 1;
  expect_refused(opened);
}
TEST_F(ClientSessionRefuses, ABatchIsMissing) {
  ASSERT_TRUE(accepts(opened));
  ASSERT_TRUE(accepts(batch(1, 0)));
  expect_refused(batch(1, 2));
}
TEST_F(ClientSessionRefuses, AnEpochThatWasNotAskedFor) {
  ASSERT_TRUE(accepts(opened));
  expect_refused(batch(2, 0));
}
TEST_F(ClientSessionRefuses, AnOlderEpochThanBefore) {
  ASSERT_TRUE(accepts(opened));
  session.look({});
  ASSERT_TRUE(accepts(batch(1, 0)));
  ASSERT_TRUE(accepts(batch(2, 1)));
  expect_refused(batch(1, 2));
}
TEST_F(ClientSessionRefuses, AnEpochOfAnEarlierConnection) {
  session.disconnected();
  session.connected({});
  ASSERT_TRUE(accepts(opened));
  expect_refused(batch(1, 0));
}
TEST_F(ClientSessionRefuses, ABatchAfterDone) {
  ASSERT_TRUE(accepts(opened));
  ASSERT_TRUE(accepts(Done{1, 0, false}));
  expect_refused(batch(1, 0));
}
TEST_F(ClientSessionRefuses, ABatchThatExceedsTheCredit) {
  ASSERT_TRUE(accepts(opened));
  expect_refused(batch(1, 0, 4 * protocol::kMinCredit));
}
TEST_F(ClientSessionRefuses, ADoneWithUpdatesMissing) {
  ASSERT_TRUE(accepts(opened));
  ASSERT_TRUE(accepts(batch(1, 0)));
  expect_refused(Done{1, 2, false});
}

}  // namespace
}  // namespace intervale
