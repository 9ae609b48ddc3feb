// A session that begins with the coarse scales of a data set ends as any other.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "common/mesh/mesh_digest.h"
#include "common/ranges/extract_meshes.h"
#include "protocol/codec.h"
#include "protocol/session/local_worker.h"
#include "protocol/session/session_state.h"
#include "tests/support/coarse_files.h"
#include "tests/support/seeds.h"

namespace intervale::coarse_files {
namespace {

// A client and the sending side, which has begun with coarse scales.
struct GrowingSession {
  explicit GrowingSession(SharedVolume volume, SessionState::Growth growth = SessionState::Growth::by_itself)
      : found(std::move(volume)),
        server([this](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return found; }, worker, growth) {
    client.connected({});
  }

  // Until nothing is left to do, or so many messages were sent to the client.
  void run(int messages = 1 << 20) {
    while (messages > 0) {
      for (const auto& bytes : client.take_messages()) {
        const auto message = protocol::decode_client_message(bytes);
        ASSERT_TRUE(message);
        const auto fault = server.receive(*message);
        ASSERT_FALSE(fault) << fault->text;
      }
      const auto message = server.next();
      if (!message) {
        if (server.has_work() || (server.waits() && worker.work())) continue;
        return;
      }
      ASSERT_TRUE(client.receive(protocol::encode(*message), {}));
      --messages;
    }
  }

  SharedVolume found;
  LocalWorker worker;
  SessionState server;
  ClientSession client{{.dataset = "made", .client = "test"}};
};

ViewRequest view_of(const Range& range, double pixels) {
  ViewRequest view;
  view.lod.camera = Camera{.eye = {150, 130, 125}, .look_at = {33, 32, 32}, .viewport = {640, 480}, .pixel_error = pixels};
  view.shown = {{range}, Refine::boundary};
  view.early = true;
  return view;
}

TEST(CoarseSessions, EndWithTheMeshOfTheWholeFile) {
  const Bytes file = file_of({70, 67, 66}, 1);
  const SharedVolume all = whole(file);
  std::vector<SharedVolume> growing;
  for (const CoarseScales& scales : scales_of(file)) growing.push_back(coarse(file, scales));
  ASSERT_EQ(growing.size(), 1U);
  growing.push_back(all);
  constexpr std::array kUsesCamera{true, false};
  for (const bool uses_camera : std::span(kUsesCamera).first(testing::cases(kUsesCamera.size()))) {
    ViewRequest view = view_of({1.25, kInf}, 1);
    if (!uses_camera) view.lod = {.error_percent = 2};
    GrowingSession at_once(all);
    ASSERT_TRUE(at_once.client.look(view));
    at_once.run();
    ASSERT_EQ(at_once.client.state(), ClientSession::State::idle);
    for (const int messages : {1, 1 << 20}) {
      GrowingSession session(growing[0]);
      ASSERT_TRUE(session.client.look(view));
      std::uint64_t before = 0;
      for (const SharedVolume& volume : growing) {
        session.found = volume;
        session.run(volume == all ? 1 << 20 : messages);
        if (messages == 1) continue;  // that the data set was opened is the first
        EXPECT_GT(session.client.mesh()->updates(), before) << "each scale more shows more";
        before = session.client.mesh()->updates();
        EXPECT_EQ(session.client.state() == ClientSession::State::idle, volume == all) << "Done comes from the whole data set";
      }
      EXPECT_EQ(session.client.state(), ClientSession::State::idle);
      EXPECT_EQ(session.client.mesh()->description().updates, all->size());
      ViewRequest rest = view;  // what is sent by estimates may differ, but not all of it
      rest.lod = {.error = 0};
      for (GrowingSession* each : {&session, &at_once}) {
        ASSERT_TRUE(each->client.look(rest));
        each->run();
      }
      EXPECT_EQ(mesh_digest(session.client.mesh()->mesh()), mesh_digest(at_once.client.mesh()->mesh()));
    }
  }
}

TEST(CoarseSessions, AViewIsDoneWithWhatIsThereIfNothingMoreComes) {
  const Bytes file = file_of({70, 67, 66}, 1);
  for (const bool is_early : {true, false}) {
    GrowingSession session(coarse(file, scales_of(file)[0]));
    ViewRequest view = view_of({1.25, kInf}, 1);
    view.early = is_early;
    ASSERT_TRUE(session.client.look(view));
    session.run();
    EXPECT_NE(session.client.state(), ClientSession::State::idle);
    session.server.end_growth();
    session.run();
    EXPECT_EQ(session.client.state(), ClientSession::State::idle);
    EXPECT_GT(session.client.mesh()->updates(), 0U);
  }
}

TEST(CoarseSessions, OnDemandAViewIsDoneWithTheScalesThatItWants) {
  std::vector<SharedVolume> growing;
  for (const CoarseScales& scales : scales_of(large())) growing.push_back(coarse(large(), scales));
  growing.push_back(whole(large()));
  ASSERT_EQ(growing.size(), 3U);
  GrowingSession session(growing[0], SessionState::Growth::on_demand);
  EXPECT_FALSE(session.server.lacks_scales());
  std::size_t there = 0;
  std::uint64_t updates = 0;
  for (const double pixels : {200.0, 12.0, 6.0, 0.5}) {
    ViewRequest view = view_of({1.25, kInf}, pixels);
    view.lod.camera->eye = {400, 350, 300};
    view.lod.camera->look_at = {67, 65, 64};
    view.early = pixels != 12;
    ASSERT_TRUE(session.client.look(view));
    session.run();
    while (session.server.lacks_scales()) {
      EXPECT_NE(session.client.state(), ClientSession::State::idle);
      ASSERT_LT(++there, growing.size());
      EXPECT_EQ(session.server.volume()->size(), growing[there - 1]->size());
      session.found = growing[there];
      session.run();
    }
    EXPECT_EQ(session.client.state(), ClientSession::State::idle) << pixels;
    EXPECT_EQ(estimates_want_finer(*growing[there], view.lod), false);
    EXPECT_TRUE(there == 0 || estimates_want_finer(*growing[there - 1], view.lod)) << "no more is asked for than is wanted";
    EXPECT_GT(session.client.mesh()->updates(), updates);
    updates = session.client.mesh()->updates();
  }
  EXPECT_EQ(there, 2U);
  ViewRequest rest = view_of({1.25, kInf}, 1);
  rest.lod = {.error = 0};
  ASSERT_TRUE(session.client.look(rest));
  session.run();
  GrowingSession at_once(growing.back());
  ASSERT_TRUE(at_once.client.look(rest));
  at_once.run();
  EXPECT_EQ(mesh_digest(session.client.mesh()->mesh()), mesh_digest(at_once.client.mesh()->mesh()));
}

// Who resumes with updates that are not there yet waits for them, and gets the rest: as from a data set that was whole.
TEST(CoarseSessions, OneThatResumesWaitsForTheScalesThatItHas) {
  const SharedVolume all = whole(large()), first = coarse(large(), scales_of(large())[0]), more = coarse(large(), scales_of(large())[1]);
  ASSERT_LT(first->size(), more->size());
  ASSERT_LT(more->size(), all->size());
  // What the client has: the first 2/3 of all scales.
  std::vector<SlotGroup> groups;
  for (UpdateIndex update; update < all->size() * 2 / 3; ++update) {
    const Place place = all->set().place(update);
    if (groups.empty() || groups.back().key != place.key) groups.push_back({.key = place.key});
    groups.back().slots |= std::uint64_t(1) << place.slot;
  }
  const std::size_t some = groups.size() / 3;
  const std::span<const SlotGroup> span = groups;
  const auto stream = [](SessionState& server) {
    std::uint64_t updates = 0;
    while (const auto message = server.next()) {
      EXPECT_FALSE(std::holds_alternative<protocol::Fault>(*message));
      if (const auto* const batch = std::get_if<protocol::Batch>(&*message)) updates += batch->updates;
    }
    return updates;
  };
  for (const auto growth : {SessionState::Growth::by_itself, SessionState::Growth::on_demand}) {
    SharedVolume there = first;
    LocalWorker worker;
    SessionState server([&there](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return there; }, worker, growth);
    const auto send = [&server](const protocol::ClientMessage& message) { return server.receive(message); };
    EXPECT_FALSE(send(protocol::Open{"made", "test", protocol::kMaxWindow, all->description().content_hash}));
    EXPECT_TRUE(std::get<protocol::Opened>(server.next().value()).resumed);
    for (const auto part : {span.first(some), span.subspan(some, some), span.subspan(2 * some)})
      EXPECT_FALSE(send(protocol::Have{{part.begin(), part.end()}}));
    EXPECT_FALSE(send(protocol::View{1, {}}));
    const std::uint64_t held = server.memory_bytes();
    EXPECT_GT(held, groups.size() * sizeof(SlotGroup) / 2);
    for (std::uint64_t epoch = 2; epoch < 100; ++epoch) EXPECT_FALSE(send(protocol::View{epoch, {}}));
    EXPECT_EQ(server.memory_bytes(), held) << "the last view is all that counts";
    EXPECT_FALSE(server.next());
    EXPECT_EQ(server.lacks_scales(), growth == SessionState::Growth::on_demand);
    there = more;
    while (server.next() || server.has_work()) EXPECT_EQ(server.volume()->size(), more->size());
    EXPECT_EQ(server.lacks_scales(), growth == SessionState::Growth::on_demand);
    there = all;
    EXPECT_FALSE(server.next()) << "it has grown";
    std::uint64_t updates = 0;
    while (server.has_work()) updates += stream(server);
    EXPECT_EQ(updates, all->size() - all->size() * 2 / 3);
    EXPECT_FALSE(server.lacks_scales());
  }
}

// What a whole data set has not is a fault, however long it was waited for; so is too much to keep, and another data set.
TEST(CoarseSessions, OneThatResumesWithWhatDoesNotExistEnds) {
  const SharedVolume all = whole(large()), first = coarse(large(), scales_of(large())[0]);
  const SlotGroup wrong{.key = all->set().place(UpdateIndex{0}).key, .slots = ~std::uint64_t(0)};
  for (const int cause : {0, 1, 2}) {
    SharedVolume there = first;
    LocalWorker worker;
    SessionState server([&there](const std::string&) -> tl::expected<SessionState::Volume, protocol::Fault> { return there; }, worker,
                        SessionState::Growth::on_demand);
    EXPECT_FALSE(server.receive(protocol::Open{"made", "test", protocol::kMaxWindow, all->description().content_hash}));
    EXPECT_TRUE(server.next());
    const protocol::Have have{std::vector<SlotGroup>(protocol::kMaxHave, wrong)};
    EXPECT_FALSE(server.receive(have));
    if (cause == 0) {
      there = all;
      EXPECT_FALSE(server.next()) << "it has grown";
      EXPECT_EQ(std::get<protocol::Fault>(server.next().value()).code, protocol::CloseCode::malformed);
    } else if (cause == 1) {
      std::optional<protocol::Fault> fault;
      int sent = 1;
      for (; !fault && sent < 1000; ++sent) fault = server.receive(have);
      EXPECT_GT(sent, 64);
      ASSERT_TRUE(fault);
      EXPECT_EQ(fault->code, protocol::CloseCode::going_away);
    } else {
      there = whole(std::apply(file_of, kFiles.front()));
      EXPECT_EQ(std::get<protocol::Fault>(server.next().value()).code, protocol::CloseCode::going_away);
    }
  }
}

}  // namespace
}  // namespace intervale::coarse_files
