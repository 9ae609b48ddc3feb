// Who is let in, and to what: tokens and origins.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "tests/support/raw_client.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using protocol::CloseCode;
using protocol::Open;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

struct Guarded {
  TempDir folder;
  std::unique_ptr<Server> server;
  Guarded() {
    ServeOptions options;
    options.tokens = folder.file("tokens", "all-of-it\nbucky-only bucky*\nother-only other\n");
    server = start(options);
  }
  [[nodiscard]] std::uint16_t port() const { return server->port(); }
};

TEST(Access, NeedsATokenInTheHeader) {
  const Guarded guarded;
  EXPECT_EQ(upgrade_status(guarded.port(), {}), 401u);
  EXPECT_EQ(upgrade_status(guarded.port(), {.authorization = "Bearer wrong"}), 401u);
  for (const char* token : {"all-of-it", "bucky-only"}) {
    RawClient client(guarded.port(), {.authorization = std::string("Bearer ") + token});
    client.send(kOpen);
    client.send(kEverything);
    EXPECT_GT(client.stream_to_end(), 0u);
  }
}

// What there is cannot be told from what there is not.
TEST(Access, ATokenOpensItsDataSetsOnly) {
  const Guarded guarded;
  for (const char* name : {"buckyball", "nothing", "../buckyball"}) {
    RawClient client(guarded.port(), {.authorization = "Bearer other-only"});
    client.send(Open{name, "", 0});
    const auto end = client.end();
    EXPECT_EQ(end.code, static_cast<unsigned>(CloseCode::forbidden)) << name;
    EXPECT_EQ(end.fault.value().text, "the token does not grant this data set");
  }
  RawClient client(guarded.port(), {.authorization = "Bearer all-of-it"});
  client.send(Open{"nothing", "", 0});
  EXPECT_EQ(client.end().code, static_cast<unsigned>(CloseCode::no_such_dataset));
}

TEST(Access, PagesSendTheirTokenAsASubprotocolAndAreToldByACloseCode) {
  const Guarded guarded;
  const std::string origin = "http://127.0.0.1";
  RawClient good(guarded.port(), {.subprotocols = "intervale.v1, intervale.token.YWxsLW9mLWl0", .origin = origin});
  good.send(kOpen);
  good.send(kEverything);
  EXPECT_GT(good.stream_to_end(), 0u);
  for (const char* offered : {"intervale.v1", "intervale.v1, intervale.token.d3Jvbmc"}) {
    RawClient bad(guarded.port(), {.subprotocols = offered, .origin = origin});
    bad.send(kOpen);
    const auto end = bad.end();
    EXPECT_EQ(end.code, static_cast<unsigned>(CloseCode::unauthorized));
    ASSERT_TRUE(end.fault);
    EXPECT_EQ(end.fault->code, CloseCode::unauthorized);
  }
}

TEST(Access, ListsWhatATokenOpens) {
  const Guarded guarded;
  const auto list = [&](const std::string& token) {
    return talk(guarded.port(), "GET /api/datasets HTTP/1.1\r\nHost: x\r\nConnection: close\r\nAuthorization: Bearer " + token + "\r\n\r\n");
  };
  EXPECT_THAT(list("wrong"), ::testing::AllOf(StartsWith("HTTP/1.1 401"), HasSubstr("WWW-Authenticate: Bearer"), Not(HasSubstr("buckyball"))));
  EXPECT_THAT(list("bucky-only"), HasSubstr("buckyball"));
  EXPECT_THAT(list("other-only"), ::testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"datasets\":[]")));
  EXPECT_THAT(get(guarded.port(), "/"), Not(HasSubstr("buckyball")));
  EXPECT_THAT(get(guarded.port(), "/metrics"), StartsWith("HTTP/1.1 401"));
  for (const char* target : {"/healthz", "/readyz"}) EXPECT_THAT(get(guarded.port(), target), StartsWith("HTTP/1.1 200"));
}

TEST(Access, TokensAreReadAgainWhenTheirFileChanges) {
  const Guarded guarded;
  const RawClient::Hello old{.authorization = "Bearer all-of-it"}, late{.authorization = "Bearer another-one"};
  RawClient running(guarded.port(), old);
  guarded.folder.file("tokens", "another-one\n");
  guarded.server->reload();
  EXPECT_EQ(upgrade_status(guarded.port(), old), 401u);
  EXPECT_EQ(upgrade_status(guarded.port(), late), 101u);
  running.send(kOpen);
  running.send(kEverything);
  EXPECT_GT(running.stream_to_end(), 0u) << "a session keeps what it was let in with";
  guarded.folder.file("tokens", "n o ! t o k e n s\n!\n");
  guarded.server->reload();
  EXPECT_EQ(upgrade_status(guarded.port(), late), 101u) << "what cannot be read changes nothing";
  std::filesystem::remove(guarded.folder / "tokens");
  guarded.server->reload();
  EXPECT_EQ(upgrade_status(guarded.port(), late), 101u);
}

TEST(Access, PagesOfOtherOriginsOpenNothing) {
  const auto server = start();
  EXPECT_EQ(upgrade_status(server->port(), {.origin = "http://127.0.0.1"}), 101u);
  EXPECT_EQ(upgrade_status(server->port(), {.origin = "http://evil.example"}), 403u);
  EXPECT_EQ(upgrade_status(server->port(), {.origin = "null"}), 403u);
  ServeOptions options;
  options.allowed_origins = {"https://good.example"};
  const auto strict = start(options);
  EXPECT_EQ(upgrade_status(strict->port(), {}), 101u);
  EXPECT_EQ(upgrade_status(strict->port(), {.origin = "https://good.example"}), 101u);
  EXPECT_EQ(upgrade_status(strict->port(), {.origin = "http://127.0.0.1"}), 403u);
}

}  // namespace
}  // namespace intervale
