// How a server begins, and how it ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "server/serve/catalogue_watcher.h"
#include "tests/support/programs.h"
#include "tests/support/raw_client.h"
#include "tests/support/serving.h"

namespace intervale {
namespace {

using protocol::CloseCode;
using protocol::Opened;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Server, AnAddressThatCannotBeHadIsAnError) {
  const auto server = start();
  for (const std::string& listen : {"127.0.0.1:" + std::to_string(server->port()), std::string("192.0.2.1:1")}) {
    ServeOptions options;
    options.listen = listen;
    const auto second = Server::start(options);
    ASSERT_FALSE(second);
    EXPECT_FALSE(second.error().usage);
    EXPECT_THAT(second.error().message, HasSubstr(listen));
  }
  for (const char* listen :
       {"", "8080", ":8080", "localhost:8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "::1:80", "[127.0.0.1]:80", "1.2.3.4:-1"}) {
    ServeOptions options;
    options.listen = listen;
    const auto wrong = Server::start(options);
    ASSERT_FALSE(wrong) << listen;
    EXPECT_TRUE(wrong.error().usage) << listen;
  }
}

TEST(Server, ListensOnVersion6) {
  ServeOptions options;
  options.listen = "[::1]:0";
  const auto server = Server::start(options);
  if (!server) GTEST_SKIP() << server.error().message;  // a machine without IPv6
  EXPECT_THAT((*server)->url(), StartsWith("http://[::1]:"));
}

TEST(Server, IsNotReadyBeforeThereIsSomethingToOffer) {
  ServeOptions options;
  options.listen = "127.0.0.1:0";
  const auto server = Server::start(options).value();
  EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(get(server->port(), "/readyz"), ::testing::AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("loading")));
  EXPECT_THAT(get(server->port(), "/api/datasets"), ::testing::AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("loading")))
      << "not that there is nothing";
  EXPECT_EQ(upgrade_status(server->port(), {}), 503u);
  server->offer(CatalogueWatcher({buckyball()}, server->memory()).load().value());
  EXPECT_THAT(get(server->port(), "/readyz"), StartsWith("HTTP/1.1 200"));
  RawClient client(server->port());
  client.send(kOpen);
  (void)client.expect<Opened>();
}

TEST(Server, StopClosesSessionsWithGoingAway) {
  const auto server = start();
  Waiting streaming(server->port());
  RawClient idle(server->port());
  std::thread stopping([&server] { server->stop(); });
  EXPECT_EQ(streaming.client.end().code, static_cast<unsigned>(CloseCode::going_away));
  EXPECT_EQ(idle.end().code, static_cast<unsigned>(CloseCode::going_away));
  stopping.join();
}

TEST(Server, SaysThatItDrainsWhileItDoes) {
  ServeOptions options;
  options.drain_time = std::chrono::seconds(30);
  const auto server = start(options);
  auto deaf = std::make_unique<Waiting>(server->port());
  std::thread stopping([&server] { server->stop(); });
  std::string ready;
  do {
    ready = get(server->port(), "/readyz");
  } while (ready.starts_with("HTTP/1.1 200"));  // until it has begun
  EXPECT_THAT(ready, ::testing::AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("draining")));
  EXPECT_EQ(upgrade_status(server->port(), {}), 503u);
  EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  const auto end = deaf->client.end();
  EXPECT_EQ(end.code, static_cast<unsigned>(CloseCode::going_away));
  ASSERT_TRUE(end.fault);
  EXPECT_EQ(end.fault->code, CloseCode::going_away);
  deaf.reset();
  stopping.join();
}

TEST(Server, StopDoesNotWaitForClientsThatDoNotLeave) {
  ServeOptions options;
  options.drain_time = std::chrono::milliseconds(50);
  const auto server = start(options);
  const Waiting deaf(server->port());
  server->stop();  // and returns
}

}  // namespace
}  // namespace intervale
