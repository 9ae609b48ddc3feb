// A server in this process, and clients that do not keep to the protocol.
#include "server/serve/server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <vector>

#include "protocol/codec.h"
#include "server/serve/catalogue_watch.h"
#include "tests/e2e/support/programs.h"
#include "tests/e2e/support/raw_client.h"
#include "tests/e2e/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using protocol::Batch;
using protocol::CloseCode;
using protocol::Credit;
using protocol::Done;
using protocol::Open;
using protocol::Opened;
using protocol::View;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

struct Attack {
  const char* name;
  CloseCode code;
  std::function<void(RawClient&)> act;
};

void PrintTo(const Attack& attack, std::ostream* out) { *out << attack.name; }

std::vector<std::uint8_t> bytes_of(std::size_t size, std::uint8_t value) { return std::vector<std::uint8_t>(size, value); }

View view_with_error(double error) {
  View view = kEverything;
  view.lod.error = error;
  return view;
}

std::vector<Attack> attacks() {
  constexpr std::size_t kTooMuch = protocol::kMaxClientMessage + 1;
  return {
      {"Garbage", CloseCode::malformed, [](RawClient& c) { c.send_binary(bytes_of(100, 0xa5)); }},
      {"Nothing", CloseCode::malformed, [](RawClient& c) { c.send_binary({}); }},
      {"LargestGarbage", CloseCode::malformed, [](RawClient& c) { c.send_binary(bytes_of(kTooMuch - 1, 1)); }},
      {"GarbageWhileStreaming", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send_binary(bytes_of(100, 0xa5));
       }},
      {"NotANumber", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(view_with_error(std::numeric_limits<double>::quiet_NaN()));
       }},
      {"AServersMessage", CloseCode::malformed,
       [](RawClient& c) {
         c.send_binary(protocol::encode(protocol::ServerMessage(protocol::Fault{CloseCode::malformed, "you"})));
       }},
      {"Text", CloseCode::text_frame, [](RawClient& c) { c.send_text("hello"); }},
      {"TextWhileStreaming", CloseCode::text_frame,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send_text("hello");
       }},
      {"TooLarge", CloseCode::too_large, [](RawClient& c) { c.send_binary(bytes_of(kTooMuch, 0)); }},
      {"MuchTooLarge", CloseCode::too_large, [](RawClient& c) { c.send_binary(bytes_of(4 << 20, 0)); }},
      {"TooLargeInPieces", CloseCode::too_large,
       [](RawClient& c) {
         for (std::size_t sent = 0; sent < kTooMuch; sent += 1000) c.send_binary(bytes_of(1000, 0), false);
       }},
      {"TooMuchCredit", CloseCode::too_large,
       [](RawClient& c) {
         c.send(Open{"buckyball", "", protocol::kMaxWindow + 1});
       }},
      {"CreditThatOverflows", CloseCode::too_large,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(Credit{std::numeric_limits<std::uint64_t>::max()});
       }},
      {"NoSuchDataset", CloseCode::no_such_dataset,
       [](RawClient& c) {
         c.send(Open{"../buckyball", "", 0});
       }},
      {"ViewBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(kEverything); }},
      {"CreditBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(Credit{1}); }},
      {"HaveBeforeOpen", CloseCode::out_of_order, [](RawClient& c) { c.send(protocol::Have{}); }},
      {"HaveAfterView", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send(protocol::Have{});
       }},
      {"ForgetsWhatIsNotThere", CloseCode::malformed,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(View{1, {}, {}, {{0, 0, supercube_key(0, {1000, 0, 0}), 1}}});
       }},
      {"OpenTwice", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kOpen);
       }},
      {"EpochTwice", CloseCode::out_of_order,
       [](RawClient& c) {
         c.send(kOpen);
         c.send(kEverything);
         c.send(kEverything);
       }},
  };
}

class Attacks : public testing::TestWithParam<Attack> {};

TEST_P(Attacks, CloseThatSessionWithTheCodeAndTouchNoOther) {
  const auto server = start();
  RawClient whole(server->port());
  whole.send(kOpen);
  whole.send(kEverything);
  const std::uint64_t everything = whole.stream_to_end();

  Waiting other(server->port());
  RawClient attacker(server->port());
  GetParam().act(attacker);
  const auto end = attacker.end();
  EXPECT_EQ(end.code, static_cast<unsigned>(GetParam().code));
  ASSERT_TRUE(end.fault);
  EXPECT_EQ(end.fault->code, GetParam().code);
  EXPECT_NE(end.fault->text, "");
  EXPECT_EQ(other.finish(), everything);
}

INSTANTIATE_TEST_SUITE_P(Server, Attacks, testing::ValuesIn(attacks()), [](const auto& attack) { return attack.param.name; });

TEST(Server, ResumesTheSameDataOnlyAndRefusesWhatItDoesNotHave) {
  const auto server = start();
  RawClient first(server->port());
  first.send(kOpen);
  const auto opened = first.expect<Opened>();
  EXPECT_FALSE(opened.resumed);
  const std::uint64_t hash = opened.description.content_hash;
  const protocol::Have nowhere{{{0, 0, supercube_key(0, {1 << 17, 0, 0}), 1}}};

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
  client.send(view_with_error(20));
  const std::uint64_t coarse = client.stream_to_end();
  client.send(View{2, {}});
  const std::uint64_t rest = client.stream_to_end();
  EXPECT_GT(coarse, 0u);
  EXPECT_EQ(coarse + rest, everything);
  client.send(View{7, {}});  // nothing is left to send
  EXPECT_EQ(client.stream_to_end(), 0u);
}

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

TEST(Server, StopClosesSessionsWithGoingAway) {
  const auto server = start();
  Waiting streaming(server->port());
  RawClient idle(server->port());
  std::thread stopping([&server] { server->stop(); });
  EXPECT_EQ(streaming.client.end().code, static_cast<unsigned>(CloseCode::going_away));
  EXPECT_EQ(idle.end().code, static_cast<unsigned>(CloseCode::going_away));
  stopping.join();
}

TEST(Server, IsNotReadyBeforeThereIsSomethingToOffer) {
  ServeOptions options;
  options.listen = "127.0.0.1:0";
  const auto server = Server::start(options).value();
  EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(get(server->port(), "/readyz"), testing::AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("loading")));
  EXPECT_THAT(get(server->port(), "/api/datasets"), HasSubstr("\"datasets\":[]"));
  EXPECT_EQ(upgrade_status(server->port(), {}), 503u);
  server->offer(CatalogueWatch({buckyball()}).load().value());
  EXPECT_THAT(get(server->port(), "/readyz"), StartsWith("HTTP/1.1 200"));
  RawClient client(server->port());
  client.send(kOpen);
  (void)client.expect<Opened>();
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

// A client that does not leave keeps the server draining until the test is through.
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
  EXPECT_THAT(ready, testing::AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("draining")));
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
    EXPECT_THAT(get(server->port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  }
  options = {};
  options.max_connections_per_address = 2;
  const auto server = start(options);
  Waiting first(server->port());
  Waiting second(server->port());
  EXPECT_EQ(talk(server->port(), ""), "");
  EXPECT_GT(first.finish(), 0u);
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
    EXPECT_EQ(end.fault.value().text, "this token does not open that data set");
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
  EXPECT_THAT(list("wrong"), testing::AllOf(StartsWith("HTTP/1.1 401"), HasSubstr("WWW-Authenticate: Bearer"), Not(HasSubstr("buckyball"))));
  EXPECT_THAT(list("bucky-only"), HasSubstr("buckyball"));
  EXPECT_THAT(list("other-only"), testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"datasets\":[]")));
  EXPECT_THAT(get(guarded.port(), "/"), Not(HasSubstr("buckyball")));
  EXPECT_THAT(get(guarded.port(), "/metrics"), StartsWith("HTTP/1.1 401"));
  for (const char* target : {"/healthz", "/readyz"}) EXPECT_THAT(get(guarded.port(), target), StartsWith("HTTP/1.1 200"));
}

TEST(Access, TokensAreReadAgainWhenTheirFileChanges) {
  const Guarded guarded;
  const RawClient::Hello old{.authorization = "Bearer all-of-it"}, late{.authorization = "Bearer another-one"};
  RawClient running(guarded.port(), old);
  guarded.folder.file("tokens", "another-one\n");
  guarded.server->refresh();
  EXPECT_EQ(upgrade_status(guarded.port(), old), 401u);
  EXPECT_EQ(upgrade_status(guarded.port(), late), 101u);
  running.send(kOpen);
  running.send(kEverything);
  EXPECT_GT(running.stream_to_end(), 0u) << "a session keeps what it was let in with";
  guarded.folder.file("tokens", "n o ! t o k e n s\n!\n");
  guarded.server->refresh();
  EXPECT_EQ(upgrade_status(guarded.port(), late), 101u) << "what cannot be read changes nothing";
  std::filesystem::remove(guarded.folder / "tokens");
  guarded.server->refresh();
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

TEST(Server, AnAddressThatCannotBeHadIsAnError) {
  const auto server = start();
  for (const std::string& listen : {"127.0.0.1:" + std::to_string(server->port()), std::string("192.0.2.1:1")}) {
    ServeOptions options;
    options.listen = listen;
    const auto second = Server::start(options, {});
    ASSERT_FALSE(second);
    EXPECT_FALSE(second.error().usage);
    EXPECT_THAT(second.error().message, HasSubstr(listen));
  }
  for (const char* listen :
       {"", "8080", ":8080", "localhost:8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "::1:80", "[127.0.0.1]:80", "1.2.3.4:-1"}) {
    ServeOptions options;
    options.listen = listen;
    const auto wrong = Server::start(options, {});
    ASSERT_FALSE(wrong) << listen;
    EXPECT_TRUE(wrong.error().usage) << listen;
  }
}

TEST(Server, ListensOnVersion6) {
  ServeOptions options;
  options.listen = "[::1]:0";
  const auto server = Server::start(options, {});
  if (!server) GTEST_SKIP() << server.error().message;  // a machine without IPv6
  EXPECT_THAT((*server)->url(), StartsWith("http://[::1]:"));
}

TEST(Http, AnswersByMethodAndTarget) {
  const auto server = start();
  const auto ask = [&](const std::string& line) { return talk(server->port(), line + " HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n"); };
  EXPECT_THAT(ask("GET /"), testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("text/html"), HasSubstr("buckyball")));
  EXPECT_THAT(ask("GET /api/datasets?x=1"),
              testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("application/json"), HasSubstr("\"dims\":[65,65,65]")));
  EXPECT_THAT(ask("GET /healthz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("GET /readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("GET /metrics"), testing::AllOf(HasSubstr("version=0.0.4"), HasSubstr("\nintervale_sessions 0\n")));
  EXPECT_THAT(ask("HEAD /"), testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Length"), Not(HasSubstr("<html"))));
  EXPECT_THAT(ask("POST /"), testing::AllOf(StartsWith("HTTP/1.1 405"), HasSubstr("Allow: GET, HEAD")));
  EXPECT_THAT(ask("GET /../etc/passwd"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(ask("GET /v1/stream"), StartsWith("HTTP/1.1 426"));
}

TEST(Metrics, TellWhatASessionGot) {
  const auto server = start();
  std::uint64_t updates = 0;
  {
    RawClient client(server->port());
    client.send(kOpen);
    client.send(kEverything);
    updates = client.stream_to_end();
    client.send(View{2, {}});
    EXPECT_EQ(client.stream_to_end(), 0u);
    EXPECT_THAT(get(server->port(), "/metrics"), HasSubstr("\nintervale_sessions 1\n"));
    client.send_text("and now a mistake");
    EXPECT_EQ(client.end().code, static_cast<unsigned>(CloseCode::text_frame));
  }
  std::string metrics;
  do {
    metrics = get(server->port(), "/metrics");
  } while (metrics.find("\nintervale_sessions 0\n") == std::string::npos);  // the server needs a moment to see the end
  for (const std::string& line :
       {"intervale_updates_sent_total " + std::to_string(updates), std::string("intervale_session_closes_total{code=\"1003\"} 1"),
        std::string("intervale_session_faults_total 1"), std::string("intervale_first_mesh_seconds_count 1"),
        std::string("intervale_view_change_seconds_count 1"), std::string("intervale_queued_bytes 0"), std::string("intervale_datasets 1")}) {
    EXPECT_THAT(metrics, HasSubstr("\n" + line + "\n"));
  }
  EXPECT_THAT(metrics, HasSubstr("intervale_dataset_memory_bytes{dataset=\"buckyball\"} "));
  EXPECT_THAT(metrics, Not(HasSubstr("intervale_selection_seconds_count 0")));
}

TEST(Metrics, HaveADoorOfTheirOwnIfAsked) {
  EXPECT_THAT(get(start({.metrics_listen = "127.0.0.1:0"})->port(), "/metrics"), StartsWith("HTTP/1.1 404"));
  const auto server = start({.metrics_listen = "127.0.0.1:0", .max_connections = 1});
  EXPECT_NE(server->metrics_port(), server->port());
  const Waiting full(server->port());
  for (const char* target : {"/metrics", "/healthz", "/readyz"})
    EXPECT_THAT(get(server->metrics_port(), target), StartsWith("HTTP/1.1 200")) << target;
  for (const char* target : {"/", "/api/datasets", "/v1/stream"})
    EXPECT_THAT(get(server->metrics_port(), target), StartsWith("HTTP/1.1 404")) << target;
}

TEST(Http, ServesTheViewerFromMemory) {
  std::unique_ptr<Server> server;
  const auto ask = [&](const std::string& lines) { return talk(server->port(), lines + "\r\nHost: a:1\r\nConnection: close\r\n\r\n"); };
  {
    const TempDir folder;
    folder.file("index.html", "<html>viewer");
    folder.file("app.js", "let a;");
    folder.file("app.js.gz", "packed");
    ServeOptions options;
    options.viewer = folder.path();
    server = start(options);
  }
  const std::string page = ask("GET / HTTP/1.1");
  EXPECT_THAT(page, testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("<html>viewer"),
                                   HasSubstr("Content-Security-Policy: default-src 'none'; script-src"), HasSubstr("ws://a:1 wss://a:1"),
                                   HasSubstr("Cross-Origin-Opener-Policy: same-origin"), HasSubstr("Referrer-Policy: no-referrer"),
                                   HasSubstr("X-Content-Type-Options: nosniff")));
  const std::string packed = ask("GET /app.js HTTP/1.1\r\nAccept-Encoding: gzip");
  EXPECT_THAT(packed, testing::AllOf(HasSubstr("Content-Encoding: gzip"), HasSubstr("Content-Length: 6"), HasSubstr("\r\n\r\npacked")));
  EXPECT_THAT(ask("HEAD /app.js HTTP/1.1"), testing::AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("Content-Length: 6"), Not(HasSubstr("let"))));
  const std::size_t etag = packed.find("ETag: ");
  ASSERT_NE(etag, std::string::npos);
  const std::string tag = packed.substr(etag + 6, packed.find('\r', etag) - etag - 6);
  EXPECT_THAT(ask("GET /app.js HTTP/1.1\r\nAccept-Encoding: gzip\r\nIf-None-Match: " + tag),
              testing::AllOf(StartsWith("HTTP/1.1 304"), HasSubstr(tag), Not(HasSubstr("Content-Length")), testing::EndsWith("\r\n\r\n")));
  EXPECT_THAT(ask("GET /%2e%2e/app.js HTTP/1.1"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(ask("GET /%00 HTTP/1.1"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(ask("GET /api/datasets HTTP/1.1"), HasSubstr("Content-Security-Policy: default-src 'none'\r\n"));
}

TEST(Http, AViewerThatIsNotThereIsAnError) {
  ServeOptions options;
  options.listen = "127.0.0.1:0";
  options.viewer = "/nonexistent";
  const auto server = Server::start(options, {});
  ASSERT_FALSE(server);
  EXPECT_THAT(server.error().message, HasSubstr("/nonexistent"));
}

TEST(Http, KeepsTheConnectionForTheNextRequest) {
  const auto server = start();
  const std::string answers =
      talk(server->port(), "GET /healthz HTTP/1.1\r\nHost: x\r\n\r\nGET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n");
  EXPECT_NE(answers.find("HTTP/1.1 200"), answers.rfind("HTTP/1.1 200"));
}

TEST(Http, WhatIsNoRequestIsToldSo) {
  const auto server = start();
  EXPECT_THAT(talk(server->port(), std::string(100, '\x01') + "\r\n\r\n"), StartsWith("HTTP/1.1 400"));
  EXPECT_THAT(talk(server->port(), "GET / HTTP/1.1\r\nX: " + std::string(5000, 'x') + "\r\n\r\n"), StartsWith("HTTP/1.1 431"));
  const std::string upgrade =
      "GET /v1/stream HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  EXPECT_THAT(talk(server->port(), upgrade), StartsWith("HTTP/1.1 400"));  // our subprotocol is not offered
}

}  // namespace
}  // namespace intervale
