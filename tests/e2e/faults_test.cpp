// What goes wrong around a server. README.md in tests/ has the table of faults and of the tests that prove what is
// promised.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/codec.h"
#include "server/serve/memory.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using protocol::Batch;
using protocol::ClientMessage;
using protocol::CloseCode;
using protocol::Credit;
using protocol::Done;
using protocol::Have;
using protocol::Open;
using protocol::Opened;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::string kHalfARequest = "GET /v1/stream HTTP/1.1\r\nHost: x\r\nUpgr";

// A connection and nothing more. Closed at its end, politely if not reset.
class Line {
 public:
  explicit Line(std::uint16_t port) { socket_.connect({boost::asio::ip::address_v4::loopback(), port}); }
  void send(const std::string& bytes) {
    boost::system::error_code ignored;
    boost::asio::write(socket_, boost::asio::buffer(bytes), ignored);
  }
  void reset() {
    socket_.set_option(boost::asio::ip::tcp::socket::linger(true, 0));
    socket_.close();
  }

 private:
  boost::asio::io_context io_;
  boost::asio::ip::tcp::socket socket_{io_};
};

// Nobody is there but who asks.
bool is_idle(std::uint16_t port) { return metric(port, "intervale_sessions") == 0 && metric(port, "intervale_connections") == 1; }

// Takes note of the descriptors that are open while a server idles, to see that no more are when it idles again.
class Idle {
 public:
  explicit Idle(std::uint16_t port) : port_(port) {
    EXPECT_TRUE(eventually([port] { return is_idle(port); }));
    descriptors_ = descriptors_of(::getpid());
  }
  [[nodiscard]] bool again() const {
    return eventually([this] { return is_idle(port_) && descriptors_of(::getpid()) <= descriptors_; });
  }

 private:
  std::uint16_t port_;
  std::size_t descriptors_ = 0;
};

// The gyroid, 97 samples a side: more than lies in the buffers on the way to who does not read.
const std::filesystem::path& large_gyroid() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    const std::string volume = folder / "volume.nrrd", made = folder / "large.ivm";
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "97", "-o", volume}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", volume, "-o", made, "--range", "-0.3", "0.3"}).status, 0);
    return std::filesystem::path(made);
  }();
  return path;
}

TEST(Faults, ASlowReaderGetsItAllAndHoldsNobodyUp) {
  const auto server = start();
  RawClient slow(server->port());
  slow.send(Open{"buckyball", "slow", protocol::kMinCredit});
  slow.send(kEverything);
  (void)slow.expect<Opened>();
  std::uint64_t updates = 0, others = 0;
  for (int batches = 0;; ++batches) {
    if (batches % 20 == 5) others = everything(server->port());  // while the slow one waits
    const auto message = slow.receive().value();
    if (std::holds_alternative<Done>(message)) break;
    updates += std::get<Batch>(message).updates;
    slow.send(Credit{protocol::cost_of(std::get<Batch>(message))});  // so that there is never more than the least
  }
  EXPECT_EQ(updates, others);
}

TEST(Faults, AReaderThatStopsIsCutWhateverItHasGranted) {
  ServeOptions options;
  options.write_time = std::chrono::milliseconds(50);
  const auto server = start(options, large_gyroid());
  RawClient stopped(server->port(), {.narrow = true});
  stopped.send(Open{"large", "stopped", protocol::kMaxWindow});
  stopped.send(kEverything);
  EXPECT_TRUE(
      eventually([&] { return metric(server->port(), "intervale_sessions_total") == 1 && metric(server->port(), "intervale_sessions") == 0; }));
  EXPECT_EQ(metric(server->port(), "intervale_queued_bytes"), 0);
  EXPECT_EQ(stopped.end().code, 0u) << "it was cut off";
}

TEST(Faults, PastWhatMayBeQueuedTheSlowestIsCut) {
  ServeOptions options;
  options.max_queued_bytes = protocol::kMinCredit;  // what is sent to the quick one is never more
  const auto server = start(options, large_gyroid());
  const Open quick{"large", "quick", protocol::kMinCredit};
  const std::uint64_t all = everything(server->port(), quick);
  RawClient stopped(server->port(), {.narrow = true});
  stopped.send(Open{"large", "stopped", protocol::kMaxWindow});
  stopped.send(kEverything);
  EXPECT_TRUE(eventually([&] { return everything(server->port(), quick) == all && metric(server->port(), "intervale_sessions") == 0; }));
  EXPECT_EQ(stopped.end().code, 0u) << "it was cut off";
}

TEST(Faults, APeerThatIsGoneWithoutAWordIsCut) {
  ServeOptions options;
  options.idle_time = std::chrono::milliseconds(50);
  const auto server = start(options);
  RawClient gone(server->port());  // which never reads again, and so answers no ping
  gone.send(kOpen);
  (void)gone.expect<Opened>();
  EXPECT_TRUE(eventually([&] { return metric(server->port(), "intervale_sessions") == 0; }));
  EXPECT_THAT(get(server->port(), "/metrics"), HasSubstr("intervale_session_closes_total{code=\"none\"} 1\n"));
}

TEST(Faults, ARequestThatDoesNotEndIsCut) {
  ServeOptions options;
  options.handshake_time = std::chrono::milliseconds(50);
  const auto server = start(options);
  for (const std::string& begun : {std::string(), std::string("G"), kHalfARequest}) {
    EXPECT_EQ(talk(server->port(), begun).find("200"), std::string::npos) << "and returns";
  }
}

struct Moment {
  const char* name;
  std::function<void(std::uint16_t)> reach_and_reset;
};

void PrintTo(const Moment& moment, std::ostream* out) { *out << moment.name; }

Moment in_session(const char* name, const std::function<void(RawClient&)>& reach) {
  return {name, [reach](std::uint16_t port) {
            RawClient client(port);
            reach(client);
            client.reset();
          }};
}

Moment on_line(const char* name, const std::string& bytes) {
  return {name, [bytes](std::uint16_t port) {
            Line line(port);
            line.send(bytes);
            line.reset();
          }};
}

std::vector<Moment> moments() {
  const auto open = [](RawClient& c) { c.send(kOpen); };
  const auto view = [open](RawClient& c) { open(c), c.send(kEverything); };
  return {
      on_line("Connected", ""),
      on_line("HalfARequest", kHalfARequest),
      on_line("ARequest", "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n"),
      in_session("Upgraded", [](RawClient&) {}),
      in_session("HalfAnOpen",
                 [](RawClient& c) {
                   const auto bytes = protocol::encode(ClientMessage(kOpen));
                   c.send_binary(std::span(bytes).first(bytes.size() / 2), false);
                 }),
      in_session("Open", open),
      in_session("Have", [open](RawClient& c) { open(c), c.send(Have{}); }),
      in_session("View", view),
      in_session("Opened", [view](RawClient& c) { view(c), (void)c.expect<Opened>(); }),
      in_session("Batch", [view](RawClient& c) { view(c), (void)c.expect<Opened>(), (void)c.expect<Batch>(); }),
      in_session("Credit", [view](RawClient& c) { view(c), c.send(Credit{protocol::kDefaultWindow}); }),
      in_session("Done", [view](RawClient& c) { view(c), (void)c.stream_to_end(); }),
      in_session("Fault", [](RawClient& c) { c.send(kEverything), (void)c.receive(); }),
  };
}

class Resets : public ::testing::TestWithParam<Moment> {};

TEST_P(Resets, EndThatSessionAndTouchNoOther) {
  const auto server = start();
  const std::uint64_t all = everything(server->port());
  const Idle idle(server->port());
  {
    Waiting other(server->port());
    for (int i = 0; i < 20; ++i) GetParam().reach_and_reset(server->port());
    EXPECT_EQ(other.finish(), all);
  }
  EXPECT_TRUE(idle.again());
}

INSTANTIATE_TEST_SUITE_P(Faults, Resets, ::testing::ValuesIn(moments()), [](const auto& moment) { return moment.param.name; });

struct Kind {
  const char* name;
  std::vector<ClientMessage> before;
  ClientMessage message;
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class Frames : public ::testing::TestWithParam<Kind> {
 protected:
  // How the session ends that says this instead of the message.
  static unsigned end_after(std::uint16_t port, std::span<const std::uint8_t> bytes) {
    RawClient client(port);
    for (const ClientMessage& message : GetParam().before) client.send(message);
    client.send_binary(bytes);
    return client.end().code;
  }
};

TEST_P(Frames, CutShortAreMalformedAndOversizeAreTooLarge) {
  const auto server = start();
  Waiting other(server->port());
  const auto bytes = protocol::encode(GetParam().message);
  for (const std::size_t size : {std::size_t{1}, std::size_t{7}, bytes.size() / 2}) {
    EXPECT_EQ(end_after(server->port(), std::span(bytes).first(size)), static_cast<unsigned>(CloseCode::malformed)) << size << " bytes";
  }
  auto astray = bytes;
  std::fill_n(astray.begin(), 4, std::uint8_t{0xff});  // where its first table is
  EXPECT_EQ(end_after(server->port(), astray), static_cast<unsigned>(CloseCode::malformed));
  auto oversize = bytes;
  oversize.resize(protocol::kMaxClientMessage + 1);
  EXPECT_EQ(end_after(server->port(), oversize), static_cast<unsigned>(CloseCode::too_large));
  EXPECT_GT(other.finish(), 0u);
}

INSTANTIATE_TEST_SUITE_P(Faults, Frames,
                         ::testing::Values(Kind{"Open", {}, kOpen}, Kind{"Have", {kOpen}, Have{{{{}, {}, supercube_key(0, {0, 0, 0}), 1}}}},
                                           Kind{"View", {kOpen}, kEverything}, Kind{"Credit", {kOpen}, Credit{1}}),
                         [](const auto& kind) { return kind.param.name; });

TEST(Faults, TenThousandConnectionsLeaveNothingBehind) {
  constexpr int kBatches = 100, kBatch = 100;
  const auto server = start();
  const std::uint64_t all = everything(server->port());
  const Idle idle(server->port());
  for (int batch = 0; batch < kBatches; ++batch) {
    const Waiting dropped(server->port());
    std::vector<std::unique_ptr<Line>> lines;
    for (int i = 1; i < kBatch; ++i) {
      lines.push_back(std::make_unique<Line>(server->port()));
      if (i % 2 == 0) lines.back()->send(kHalfARequest);
      if (i % 4 != 0) lines.back()->reset();
    }
  }
  EXPECT_TRUE(idle.again());
  EXPECT_EQ(everything(server->port()), all);
}

TEST(Faults, WhatFollowsABodyIsNoRequest) {
  const auto server = start();
  const std::string hidden = "GET /readyz HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n";
  for (const std::string& length : {std::string("Transfer-Encoding: chunked"), std::string("Transfer-Encoding: gzip"),
                                    std::string("Transfer-Encoding: xchunked"), "Content-Length: " + std::to_string(hidden.size())}) {
    for (const char* method : {"GET", "POST"}) {
      const std::string answers = talk(server->port(), method + (" /healthz HTTP/1.1\r\nHost: x\r\n" + length + "\r\n\r\n") + hidden);
      EXPECT_THAT(answers, StartsWith("HTTP/1.1 "));
      EXPECT_EQ(answers.find("HTTP/1.1 ", 1), std::string::npos) << method << ' ' << length;
    }
  }
}

TEST(Faults, WhoHasNoTokenTakesNoOnesPlace) {
  const TempDir folder;
  ServeOptions options;
  options.tokens = folder.file("tokens", "good\n");
  options.max_sessions = 1;
  options.allowed_origins = {"*"};
  const auto server = start(options);
  RawClient page(server->port(), {.authorization = "Bearer bad", .origin = "https://viewer.example"});
  EXPECT_EQ(upgrade_status(server->port(), {.authorization = "Bearer good"}), 101u);
  EXPECT_EQ(page.end().code, 4401u);
}

TEST(Faults, ManyWhoComeAtOnceDoNotTakeTheMemoryThatIsLeft) {
  ServeOptions options;
  options.max_memory = 32 << 20;
  const auto server = start(options);
  RawClient client(server->port());
  const Memory::Share taken(server->memory(), Memory::Holder::sessions, *options.max_memory);
  client.send(kOpen);
  EXPECT_EQ(client.end().code, 1001u) << "come back later, or to another replica";
}

}  // namespace
}  // namespace intervale
