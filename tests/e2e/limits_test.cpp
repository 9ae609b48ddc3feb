// How much a server takes on, and how long it waits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "client/net/connection.h"
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
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Server, ASessionThatDoesNotOpenIsClosed) {
  ServeOptions options;
  options.handshake_time = std::chrono::milliseconds(50);
  const auto server = start(options);
  RawClient client(server->port());
  EXPECT_EQ(client.end().code, static_cast<unsigned>(CloseCode::timed_out));
}

TEST(Server, ASessionThatGrantsNothingIsClosed) {
  ServeOptions options;
  options.stall_time = std::chrono::milliseconds(50);
  const auto server = start(options);
  RawClient client(server->port());
  client.send(Open{"buckyball", "", 0});
  client.send(kEverything);
  EXPECT_EQ(client.end().code, static_cast<unsigned>(CloseCode::timed_out));
}

TEST(Server, TurnsConnectionsAwayAtItsLimit) {
  ServeOptions options;
  options.max_connections = 2;
  const auto server = start(options);
  Waiting first(server->port());
  Waiting second(server->port());
  EXPECT_EQ(talk(server->port(), ""), "");
  EXPECT_GT(first.finish(), 0u);
  EXPECT_GT(second.finish(), 0u);
}

TEST(Server, SilentConnectionsMakeRoomForOthers) {
  ServeOptions options;
  options.max_connections = 3;
  const auto server = start(options);
  Waiting session(server->port());
  boost::asio::io_context io;
  boost::asio::ip::tcp::socket first(io), second(io);
  for (auto* const silent : {&first, &second}) silent->connect({boost::asio::ip::address_v4::loopback(), server->port()});
  EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  char byte = 0;
  boost::system::error_code error;
  EXPECT_EQ(first.read_some(boost::asio::buffer(&byte, 1), error), 0u) << "it is cut";
  EXPECT_TRUE(second.is_open());
  EXPECT_GT(session.finish(), 0u);
}

TEST(Server, TurnsSessionsAwayAtItsLimits) {
  ServeOptions options;
  options.max_sessions = 1;
  {
    const auto server = start(options);
    const Waiting only(server->port());
    EXPECT_EQ(upgrade_status(server->port(), {}), 503u);
    EXPECT_THAT(get(server->port(), "/metrics"), HasSubstr("intervale_refused_total{reason=\"sessions\"} 1\n"));
  }
  options = {};
  options.max_memory = 1;
  {
    const auto server = start(options);
    EXPECT_EQ(upgrade_status(server->port(), {}), 503u);
    const auto opened = StreamConnection::open(parse_url("ws://127.0.0.1:" + std::to_string(server->port())).value());
    ASSERT_FALSE(opened);
    EXPECT_THAT(opened.error().message, EndsWith("accepts no new sessions now: the server has no capacity for another session"));
    EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
    EXPECT_THAT(get(server->port(), "/readyz"), StartsWith("HTTP/1.1 503"));
  }
  options = {};
  options.max_connections_per_address = 2;
  const auto server = start(options);
  Waiting first(server->port());
  Waiting second(server->port());
  EXPECT_EQ(talk(server->port(), ""), "");
  EXPECT_GT(first.finish(), 0u);
}

TEST(Server, CountsClientsBehindATrustedProxyByTheAddressThatItNames) {
  const auto upgrade = [](const Server& server, const char* forwarded_for) {
    return std::make_unique<RawClient>(server.port(), RawClient::Hello{.forwarded_for = forwarded_for});
  };
  ServeOptions options;
  options.max_connections_per_address = 1;
  options.proxies = TrustedProxies::parse(std::vector<std::string>{"127.0.0.0/8"}).value();
  const auto server = start(options);
  const auto first = upgrade(*server, "192.0.2.1"), second = upgrade(*server, "192.0.2.1, 192.0.2.2, 127.0.0.1");
  EXPECT_THROW(upgrade(*server, "192.0.2.3, 192.0.2.1"), std::exception);
  const auto third = upgrade(*server, "192.0.2.3");
  first->send(kOpen);
  first->send(kEverything);
  EXPECT_GT(first->stream_to_end(), 0u);
}

TEST(Server, ReadsASessionThatSaysTooMuchMoreSlowly) {
  ServeOptions options;
  options.messages_per_second = 50;
  options.views_per_second = 20;
  const auto server = start(options);
  RawClient client(server->port());
  client.send(kOpen);
  const auto begun = std::chrono::steady_clock::now();
  for (std::uint64_t epoch = 1; epoch <= 30; ++epoch) client.send(View{epoch, {}});
  (void)client.expect<Opened>();
  for (std::uint64_t epoch = 0; epoch < 30;) {  // 20 at once, and 10 more within half a second
    const auto message = client.receive().value();
    if (const auto* batch = std::get_if<Batch>(&message)) epoch = batch->epoch, client.send(Credit{protocol::cost_of(*batch)});
    if (const auto* done = std::get_if<Done>(&message)) epoch = done->epoch;
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(450));
}

}  // namespace
}  // namespace intervale
