// Sessions of clients that keep to the protocol.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <variant>

#include "protocol/codec.h"
#include "tests/support/raw_client.h"
#include "tests/support/serving.h"

namespace intervale {
namespace {

using protocol::Batch;
using protocol::CloseCode;
using protocol::Credit;
using protocol::Done;
using protocol::Open;
using protocol::Opened;
using protocol::View;

TEST(Server, NeverSendsMoreThanItWasGranted) {
  const auto server = start();
  RawClient client(server->port());
  client.send(Open{"buckyball", "", 0});
  client.send(kEverything);
  (void)client.expect<Opened>();
  std::uint64_t left = 0;
  std::uint64_t updates = 0;
  for (std::uint64_t grant = protocol::kMinCredit;; grant = grant * 3 / 2) {
    client.send(Credit{grant});
    left += grant;
    bool done = false;
    while (left >= protocol::kMinCredit && !done) {  // with so much left, the server sends
      const auto message = client.receive().value();
      done = std::holds_alternative<Done>(message);
      if (done) continue;
      const auto& batch = std::get<Batch>(message);
      ASSERT_LE(protocol::encode(message).size(), protocol::cost_of(batch));
      ASSERT_LE(protocol::cost_of(batch), left);
      left -= protocol::cost_of(batch);
      updates += batch.updates;
    }
    if (done) break;
  }
  EXPECT_GT(updates, 10000u);
}

TEST(Server, ANewViewGoesOnFromWhatWasSent) {
  const auto server = start();
  RawClient whole(server->port());
  whole.send(kOpen);
  whole.send(kEverything);
  const std::uint64_t everything = whole.stream_to_end();

  RawClient client(server->port());
  client.send(kOpen);
  View rough = kEverything;
  rough.lod.error = 20;
  client.send(rough);
  const std::uint64_t coarse = client.stream_to_end();
  client.send(View{2, {}});
  const std::uint64_t rest = client.stream_to_end();
  EXPECT_GT(coarse, 0u);
  EXPECT_EQ(coarse + rest, everything);
  client.send(View{7, {}});  // nothing is left to send
  EXPECT_EQ(client.stream_to_end(), 0u);
}

TEST(Server, ResumesTheSameDataOnlyAndRefusesWhatItDoesNotHave) {
  const auto server = start();
  RawClient first(server->port());
  first.send(kOpen);
  const auto opened = first.expect<Opened>();
  EXPECT_FALSE(opened.resumed);
  const std::uint64_t hash = opened.description.content_hash;
  const protocol::Have nowhere{{{{}, {}, supercube_key(0, {1 << 17, 0, 0}), 1}}};

  Open other = kOpen;
  other.resume = hash + 1;
  RawClient changed(server->port());
  changed.send(other);
  changed.send(nowhere);
  changed.send(kEverything);
  EXPECT_FALSE(changed.expect<Opened>().resumed);
  EXPECT_GT(changed.stream_to_end(), 0u) << "it starts afresh, and what it had is nobody's concern";

  Open same = kOpen;
  same.resume = hash;
  RawClient liar(server->port());
  liar.send(same);
  EXPECT_TRUE(liar.expect<Opened>().resumed);
  liar.send(nowhere);
  EXPECT_EQ(liar.end().code, static_cast<unsigned>(CloseCode::malformed));
}

TEST(Server, SessionsKeepWhatTheyOpenedWhenItIsGone) {
  const auto server = start();
  Waiting before(server->port());
  RawClient late(server->port());
  server->offer({});
  EXPECT_GT(before.finish(), 10000u);
  late.send(kOpen);
  EXPECT_EQ(late.end().code, static_cast<unsigned>(CloseCode::no_such_dataset));
}

}  // namespace
}  // namespace intervale
