// What goes wrong around a server. README.md in tests/ has the table of faults and of the tests that prove what is promised.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <filesystem>
#include <functional>
#include <iterator>
#include <memory>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <variant>
#include <vector>

#include "protocol/codec.h"
#include "server/serve/catalogue_watch.h"
#include "tests/e2e/support/programs.h"
#include "tests/e2e/support/serving.h"
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
using protocol::View;
using testing::HasSubstr;
using testing::StartsWith;

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

std::size_t descriptors_of(int process) {
  const std::filesystem::directory_iterator all("/proc/" + std::to_string(process) + "/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

double metric(std::uint16_t port, const std::string& name) {
  const std::string text = get(port, "/metrics");
  const std::string before = "\n" + name + " ";
  const std::size_t at = text.find(before);
  return at == std::string::npos ? -1 : std::stod(text.substr(at + before.size()));
}

// What a server does once it has noticed; it has a minute.
bool eventually(const std::function<bool()>& holds) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (!holds()) {
    if (std::chrono::steady_clock::now() >= until) return false;
  }
  return true;
}

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
const std::filesystem::path& large() {
  static const TempDir folder;
  static const std::filesystem::path path = [] {
    const std::string volume = folder / "volume.nrrd", made = folder / "large.ivm";
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "97", "-o", volume}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", volume, "-o", made, "--range", "-0.3", "0.3"}).status, 0);
    return std::filesystem::path(made);
  }();
  return path;
}

std::uint64_t everything(std::uint16_t port, const Open& open = kOpen) {
  RawClient client(port);
  client.send(open);
  client.send(kEverything);
  return client.stream_to_end();
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
  const auto server = start(options, large());
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
  const auto server = start(options, large());
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

class Resets : public testing::TestWithParam<Moment> {};

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

INSTANTIATE_TEST_SUITE_P(Faults, Resets, testing::ValuesIn(moments()), [](const auto& moment) { return moment.param.name; });

struct Kind {
  const char* name;
  std::vector<ClientMessage> before;
  ClientMessage message;
};

void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }

class Frames : public testing::TestWithParam<Kind> {
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
                         testing::Values(Kind{"Open", {}, kOpen}, Kind{"Have", {kOpen}, Have{{{0, 0, supercube_key(0, {0, 0, 0}), 1}}}},
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

TEST(Faults, WithoutDescriptorsWhoIsInGoesOnAndOthersComeInLater) {
  ServerProgram server;
  const std::uint64_t all = everything(server.port());
  Waiting inside(server.port());
  rlimit limit{};
  ASSERT_EQ(::prlimit(server.process().id(), RLIMIT_NOFILE, nullptr, &limit), 0);
  limit.rlim_cur = descriptors_of(server.process().id()) + 4;
  ASSERT_EQ(::prlimit(server.process().id(), RLIMIT_NOFILE, &limit, nullptr), 0);
  {
    std::vector<std::unique_ptr<Line>> lines;
    for (int i = 0; i < 32; ++i) lines.push_back(std::make_unique<Line>(server.port()));
    EXPECT_TRUE(server.process().wait_for("cannot accept a connection: Too many open files"));
    EXPECT_EQ(inside.finish(), all);
  }
  EXPECT_THAT(get(server.port(), "/readyz"), StartsWith("HTTP/1.1 200"));
  EXPECT_EQ(everything(server.port()), all);
}

// What the server reads while it runs, it reads once it can: a token that was taken out must not stay.
TEST(Faults, WithoutDescriptorsFilesAreReadLater) {
  const TempDir folder;
  const std::filesystem::path data = folder / "data", tokens = folder.file("tokens", "old\n");
  std::filesystem::create_directory(data);
  std::filesystem::copy_file(buckyball(), data / "a.ivm");
  ServerProgram server(data, {"--tokens", tokens});
  const auto limit_to = [&server](rlim_t most) {
    rlimit limit{};
    ASSERT_EQ(::prlimit(server.process().id(), RLIMIT_NOFILE, nullptr, &limit), 0);
    limit.rlim_cur = std::min(most, limit.rlim_max);
    ASSERT_EQ(::prlimit(server.process().id(), RLIMIT_NOFILE, &limit, nullptr), 0);
  };
  limit_to(0);
  folder.file("tokens", "replaced\n");
  std::filesystem::copy_file(buckyball(), data / "b.ivm");
  const auto all_of = [&server](const std::vector<std::string>& said) {
    return std::all_of(said.begin(), said.end(), [&server](const std::string& text) { return server.process().wait_for(text).has_value(); });
  };
  EXPECT_TRUE(all_of({"data: Too many open files; what was read before stays", "tokens: Too many open files; what was read before holds"}));
  limit_to(1024);
  EXPECT_TRUE(all_of({"read the tokens again", "b.ivm was read"}));
  EXPECT_EQ(run({program("intervale-client"), "list", server.url(), "--token", "old"}).status, 1);
  const auto listed = run({program("intervale-client"), "list", server.url(), "--token", "replaced"});
  EXPECT_THAT(listed.out, testing::AllOf(HasSubstr("a"), HasSubstr("b")));
}

TEST(Faults, ADiskThatFillsUpWhileBuildingIsOneLineAndKeepsWhatWasThere) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd";
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "65", "-o", volume}).status, 0);
  const auto full = run({program("intervale"), "build", volume, "-o", "/dev/full", "--range", "128", "188"});
  EXPECT_EQ(full.status, 1);
  EXPECT_EQ(full.err, "intervale: cannot write '/dev/full': No space left on device\n");

  // A disk of 64 KiB, seen by this command alone; prints what is on it at the end.
  const std::string script =
      "mount -t tmpfs -o size=64k none \"$1\" || exit 77; echo before > \"$1/x.ivm\"; \"$2\" build \"$3\" -o \"$1/x.ivm\" --range 128 188; "
      "status=$?; ls -A \"$1\"; cat \"$1/x.ivm\"; exit $status";
  const auto disk = folder / "disk";
  std::filesystem::create_directory(disk);
  const auto small = run({"/usr/bin/env", "unshare", "--map-root-user", "--mount", "sh", "-c", script, "sh", disk, program("intervale"), volume});
  if (small.status != 1) GTEST_SKIP() << "no small disk can be had here: " << small.err;
  EXPECT_THAT(small.err, testing::AllOf(StartsWith("intervale: cannot write '"), HasSubstr("No space left on device")));
  EXPECT_EQ(std::count(small.err.begin(), small.err.end(), '\n'), 1) << small.err;
  EXPECT_EQ(small.out, "x.ivm\nbefore\n");
}

// The running server's own clock, that of the wall, by a day; its log tells.
TEST(Faults, AClockThatIsSetMattersToNobody) {
  const char* const faketime = "/usr/lib/" INTERVALE_ARCHITECTURE "/faketime/libfaketimeMT.so.1";
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer's runtime would have to come before faketime's";
#endif
  if (::access(faketime, R_OK) != 0) GTEST_SKIP() << "no faketime here";
  const TempDir folder;
  const std::string clock = folder / "clock";
  const auto set_clock = [&](const std::string& offset) { std::filesystem::rename(folder.file("clock.new", offset), clock); };
  set_clock("+0");
  const auto data = folder / "data";
  std::filesystem::create_directory(data);
  std::filesystem::copy_file(buckyball(), data / "buckyball.ivm");
  ServerProgram server(data, {"--log-level", "debug"},
                       {std::string("LD_PRELOAD=") + faketime, "FAKETIME_TIMESTAMP_FILE=" + clock, "FAKETIME_NO_CACHE=1",
                        "FAKETIME_DONT_FAKE_MONOTONIC=1", "NO_FAKE_STAT=1"});
  const std::uint64_t all = everything(server.port());
  Waiting inside(server.port());
  for (const std::string offset : {"-1d", "+1d", "-1d"}) {
    set_clock(offset);
    EXPECT_EQ(everything(server.port()), all) << offset;
  }
  EXPECT_EQ(inside.finish(), all);
  std::filesystem::copy_file(buckyball(), data / "later.ivm");
  const auto said = server.process().wait_for("later.ivm was read");
  ASSERT_TRUE(said);
  std::set<std::string> days;
  std::istringstream lines(*said);
  for (std::string line; std::getline(lines, line);) days.insert(line.substr(0, 10));
  EXPECT_GE(days.size(), 2u) << "the clock was not set: " << *said;
}

// As a clock that was set back makes it.
TEST(Faults, AFileOlderThanTheOneItReplacesIsTakenUp) {
  const TempDir folder;
  const std::string volume = folder / "volume.nrrd", path = folder / "served.ivm";
  const auto build = [&](const char* low) { return run({program("intervale"), "build", volume, "-o", path, "--range", low, "188"}).status; };
  ASSERT_EQ(run({program("intervale"), "sample", "buckyball", "--size", "17", "-o", volume}).status, 0);
  ASSERT_EQ(build("128"), 0);
  CatalogueWatch watch({folder.path()});
  const auto before = watch.load().value().find("served");
  const auto time = std::filesystem::last_write_time(path);
  ASSERT_EQ(build("100"), 0);
  std::filesystem::last_write_time(path, time - std::chrono::hours(24));
  EXPECT_FALSE(watch.look()) << "it may be under way";
  const auto changed = watch.look();
  ASSERT_TRUE(changed);
  EXPECT_EQ(changed->find("served")->description().range.alpha, 100);
  EXPECT_EQ(before->description().range.alpha, 128);
}

}  // namespace
}  // namespace intervale
