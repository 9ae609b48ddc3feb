// The load harness as its users have it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/complaints.h"
#include "tests/support/peers.h"
#include "tests/support/programs.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<std::string> command(const std::string& url, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{program("intervale-load"), url};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

nlohmann::json load(const std::string& url, std::vector<std::string> more) {
  more.emplace_back("--json");
  const Finished finished = run(command(url, more));
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_EQ(finished.err, "");
  auto json = nlohmann::json::parse(finished.out, nullptr, false);
  EXPECT_EQ(json.at("failed"), 0) << json;
  EXPECT_EQ(json.at("errors"), 0) << json;
  return json;
}

void expect_refusal(const Finished& finished, int status, const std::string& about) { expect_complaint(finished, status, about, "intervale-load: "); }

TEST(Load, FullBringsEveryClientTheWholeStream) {
  ServerProgram server;
  const auto info = nlohmann::json::parse(run({program("intervale"), "info", buckyball(), "--json"}).out);
  const auto figures = load(server.url("buckyball"), {"--clients", "7", "--duration", "60", "--scenario", "full", "--ramp", "0.1", "--verify"});
  EXPECT_EQ(figures.at("clients"), 7);
  EXPECT_EQ(figures.at("connected"), 7);
  EXPECT_EQ(figures.at("complete"), 7);
  EXPECT_EQ(figures.at("verified"), 7);
  EXPECT_EQ(figures.at("views"), 7);
  EXPECT_EQ(figures.at("updates"), 7 * info.at("updates").get<std::uint64_t>());
  EXPECT_GT(figures.at("bytes"), 0);
  EXPECT_LT(figures.at("seconds"), 60.0);
  EXPECT_GT(figures.at("updates_per_s"), 0.0);
  EXPECT_GT(figures.at("bytes_per_s"), 0.0);
  for (const char* key : {"first_mesh_ms", "first_mesh_bytes", "view_change_ms"}) {
    const auto& p = figures.at(key);
    EXPECT_GT(p.at("p50"), 0.0) << key;
    EXPECT_LE(p.at("p50"), p.at("p95")) << key;
    EXPECT_LE(p.at("p95"), p.at("p99")) << key;
  }
}

class LoadScenarios : public ::testing::TestWithParam<const char*> {};

TEST_P(LoadScenarios, EveryViewIsAnswered) {
  ServerProgram server;
  const auto figures = load(server.url("buckyball"), {"--clients", "5", "--duration", "0.8", "--ramp", "0.2", "--scenario", GetParam(),
                                                      "--views-per-second", "10", "--seed", "3", "--threads", "2", "--verify", "--grace", "60"});
  EXPECT_EQ(figures.at("connected"), 5);
  EXPECT_EQ(figures.at("verified"), 5);
  EXPECT_GT(figures.at("views"), 5);
  EXPECT_EQ(figures.at("unanswered_views"), 0);
  EXPECT_GT(figures.at("view_change_ms").at("p99"), 0.0);
  EXPECT_GT(figures.at("first_mesh_ms").at("p50"), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Load, LoadScenarios, ::testing::Values("orbit", "zoom", "jump"));

// A gyroid of every range, 20 samples a side.
struct EveryRangeFolder {
  const TempDir folder;
  const std::string file = folder / "every.ivm";
  EveryRangeFolder() {
    EXPECT_EQ(run({program("intervale"), "sample", "gyroid", "--size", "20", "-o", folder / "gyroid.nrrd"}).status, 0);
    EXPECT_EQ(run({program("intervale"), "build", folder / "gyroid.nrrd", "-o", file, "--step", "0.001"}).status, 0);
  }
};

// The first drag, and the begin of the second one.
TEST(Load, ADraggedRangeIsAnsweredWithItsMesh) {
  const EveryRangeFolder every;
  ServerProgram server(every.file);
  const std::vector<std::string> options{"--clients",  "4",     "--duration",         "1.8",     "--ramp", "0.2",
                                         "--scenario", "range", "--views-per-second", "20",      "--seed", "3",
                                         "--threads",  "2",     "--verify",           "--grace", "60"};
  for (const std::vector<std::string>& more : std::vector<std::vector<std::string>>{
           {}, {"--range", "-0.2", "0.4"}, {"--range", "0.5", "inf", "--refine", "uniform"}, {"--max-tets", "3000", "--max-kept", "2500"}}) {
    std::vector<std::string> all = options;
    all.insert(all.end(), more.begin(), more.end());
    const auto figures = load(server.url("every"), all);
    EXPECT_EQ(figures.at("scenario"), "range");
    EXPECT_EQ(figures.at("connected"), 4);
    EXPECT_EQ(figures.at("verified"), 4);
    EXPECT_EQ(figures.at("differing"), 0);
    EXPECT_GT(figures.at("views"), 4 * 11);
    EXPECT_EQ(figures.at("unanswered_views"), 0);
    EXPECT_GE(figures.at("view_done_ms").at("p99"), figures.at("view_change_ms").at("p99"));
    EXPECT_GT(figures.at("view_bytes").at("max"), 0.0);
    EXPECT_GT(figures.at("set_range_ms").at("p50"), 0.0);
    const bool keeps_all = std::ranges::find(more, "--max-kept") == more.end();
    if (keeps_all) {
      EXPECT_EQ(figures.at("complete"), 4);
    }
  }
}

TEST(Load, ARangeIsDraggedInADataSetOfEveryRangeOnly) {
  const std::vector<std::string> options{"--clients", "1", "--duration", "1", "--scenario", "range"};
  ServerProgram one;
  expect_refusal(run(command(one.url("buckyball"), options)), 2, "needs a data set of every range");
  const EveryRangeFolder every;
  ServerProgram server(every.file);
  std::vector<std::string> two = options;
  two.insert(two.end(), {"--range", "0", "1", "--range", "0.5", "1"});
  expect_refusal(run(command(server.url("every"), two)), 2, "one range each");
}

// A client whose mesh is ever larger fails; what it shows is compared with what extract gives for that.
TEST(Load, ABudgetIsKeptWhereverClientsLook) {
  ServerProgram server;
  const auto figures = load(server.url("buckyball"), {"--clients", "4", "--duration", "1.2", "--ramp", "0.2", "--scenario", "jump", "--pixel-error",
                                                      "0.5", "--views-per-second", "8", "--threads", "2", "--verify", "--max-tets", "20000"});
  EXPECT_EQ(figures.at("connected"), 4);
  EXPECT_EQ(figures.at("failed"), 0);
  EXPECT_EQ(figures.at("verified"), 4);
  EXPECT_EQ(figures.at("differing"), 0);
}

// The same for what it keeps at all: a client that is sent more fails, and so does one that forgets other updates than
// its server.
TEST(Load, ClientsThatKeepLittleForgetWhatTheServerForgets) {
  ServerProgram server;
  const auto figures =
      load(server.url("buckyball"), {"--clients", "4", "--duration", "1.5", "--ramp", "0.2", "--scenario", "jump", "--pixel-error", "0.5",
                                     "--views-per-second", "8", "--threads", "2", "--verify", "--max-tets", "20000", "--max-kept", "3000"});
  EXPECT_EQ(figures.at("connected"), 4);
  EXPECT_EQ(figures.at("failed"), 0);
  EXPECT_EQ(figures.at("verified"), 4);
  EXPECT_EQ(figures.at("differing"), 0);
  EXPECT_GT(figures.at("updates"), 4 * 3000) << "something came again";
}

// The views are as many as without, and the meshes are as right.
TEST(Load, ClientsTellWhatTheirMeshesHide) {
  const EveryRangeFolder every;
  ServerProgram one, any(every.file);
  const std::vector<std::string> options{
      "--clients", "3",        "--duration",   "1",       "--ramp", "0", "--views-per-second", "5", "--pixel-error", "0.5", "--threads",
      "2",         "--verify", "--depth-maps", "--grace", "60"};
  for (const std::string scenario : {"orbit", "range"}) {
    std::vector<std::string> all = options;
    all.insert(all.end(), {"--scenario", scenario});
    const auto figures = load(scenario == "range" ? any.url("every") : one.url("buckyball"), all);
    EXPECT_GE(figures.at("depth_maps"), 3) << scenario;
    EXPECT_EQ(figures.at("verified"), 3);
    EXPECT_EQ(figures.at("differing"), 0);
    EXPECT_EQ(figures.at("unanswered_views"), 0);
    EXPECT_LE(figures.at("views"), 3 * (1 + 5));
    EXPECT_LE(figures.at("done_views"), figures.at("views"));
  }
  EXPECT_EQ(load(one.url("buckyball"), {"--clients", "1", "--duration", "0.5", "--verify"}).at("depth_maps"), 0);
}

TEST(Load, ARateIsKeptTo) {
  ServerProgram server;
  const auto figures = load(server.url("buckyball"), {"--clients", "2", "--duration", "0.5", "--ramp", "0", "--scenario", "full", "--rate", "40000"});
  EXPECT_EQ(figures.at("complete"), 0);
  EXPECT_GT(figures.at("bytes"), 0);
  EXPECT_LE(figures.at("bytes_per_s"), 2 * 40000.0);
  EXPECT_GE(figures.at("first_mesh_ms").at("p50").get<double>(), 1000 * figures.at("first_mesh_bytes").at("p50").get<double>() / 40000);
}

TEST(Load, FiguresForPeople) {
  ServerProgram server;
  const auto finished = run(command(server.url("buckyball"), {"--clients", "2", "--duration", "0.2"}));
  EXPECT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("2 of 2 clients connected, 0 failed"));
  EXPECT_THAT(finished.out, HasSubstr("view change"));
  EXPECT_EQ(finished.err, "");
}

TEST(Load, ADatasetOfTheEnvironment) {
  ServerProgram server;
  ::setenv("INTERVALE_CLIENTS", "3", 1);
  const auto figures = load(server.url("buckyball"), {"--duration", "0.1", "--scenario", "full"});
  ::unsetenv("INTERVALE_CLIENTS");
  EXPECT_EQ(figures.at("clients"), 3);
}

TEST(Load, AServerThatDiesIsStatus1WithFigures) {
  for (const int signal : {SIGKILL, SIGTERM}) {
    ServerProgram server;
    Process load(command(server.url("buckyball"), {"--clients", "4", "--duration", "60", "--ramp", "0", "--json"}));
    ASSERT_TRUE(server.process().wait_for("session 4 "));  // after the one that asks about the data set
    server.process().signal(signal);
    const Finished finished = load.wait();
    EXPECT_EQ(finished.status, 1);
    EXPECT_THAT(finished.err, StartsWith("intervale-load: 4 of 4 clients failed: "));
    EXPECT_EQ(std::count(finished.err.begin(), finished.err.end(), '\n'), 1) << finished.err;
    const auto figures = nlohmann::json::parse(finished.out, nullptr, false);
    EXPECT_EQ(figures.at("failed"), 4) << finished.out;
    EXPECT_EQ(figures.at("errors"), 4) << finished.out;
    if (signal == SIGTERM) {
      EXPECT_GT(figures.at("protocol_closes"), 0) << finished.out;
    }
  }
}

TEST(Load, AServerThatIsNotFoundAgainInTimeIsLost) {
  ServerProgram server(buckyball().string(), {"--log-level", "debug"});
  Process load(command(server.url("buckyball"),
                       {"--clients", "4", "--duration", "60", "--ramp", "0", "--pixel-error", "0.5", "--verify", "--reconnect", "0.5", "--json"}));
  for (const int session : {3, 4, 5, 6})  // after those that ask about the data set and take it
    ASSERT_TRUE(server.process().wait_for("session " + std::to_string(session) + " view 1\n"));
  server.process().signal(SIGKILL);
  const Finished finished = load.wait();
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.err, StartsWith("intervale-load: 4 of 4 clients failed: lost the server"));
  const auto figures = nlohmann::json::parse(finished.out, nullptr, false);
  EXPECT_EQ(figures.at("failed"), 4) << finished.out;
  EXPECT_EQ(figures.at("reconnects"), 0) << finished.out;
}

TEST(Load, AServerThatIsFullSaysSo) {
  const ServerProgram narrow(buckyball().string(), {"--max-sessions", "1"});
  const auto finished = run(command(narrow.url("buckyball"), {"--clients", "4", "--duration", "1"}));
  EXPECT_EQ(finished.status, 1);
  EXPECT_THAT(finished.err, ::testing::EndsWith("accepts no new sessions now: the server has no capacity for another session\n"));
}

TEST(Load, ServersThatCannotBeLoadedAreOneLine) {
  expect_refusal(run(command("ws://127.0.0.1:1/x", {"--clients", "1", "--duration", "1"})), 1, "cannot connect to 127.0.0.1:1");
  ServerProgram server;
  expect_refusal(run(command(server.url("fullerene"), {"--clients", "1", "--duration", "1"})), 1, "no data set 'fullerene'");
  const Stranger stranger("220 mail ready\r\n");
  expect_refusal(run(command(stranger.url("x"), {"--clients", "1", "--duration", "1"})), 1, "is not an intervale server");
}

TEST(Load, WrongUsageIsStatus2) {
  const std::string url = "ws://127.0.0.1:1/x";
  const std::vector<std::string> good{"--clients", "1", "--duration", "1"};
  const auto with = [&good](std::vector<std::string> more) {
    more.insert(more.end(), good.begin(), good.end());
    return more;
  };
  expect_refusal(run({program("intervale-load")}), 2, "URL");
  expect_refusal(run(command(url, {"--duration", "1"})), 2, "--clients");
  expect_refusal(run(command(url, {"--clients", "1"})), 2, "--duration");
  expect_refusal(run(command(url, {"--clients", "0", "--duration", "1"})), 2, "--clients");
  expect_refusal(run(command(url, {"--clients", "-1", "--duration", "1"})), 2, "--clients");
  expect_refusal(run(command(url, {"--clients", "1", "--duration", "nan"})), 2, "--duration");
  expect_refusal(run(command(url, with({"--scenario", "dance"}))), 2, "orbit");
  expect_refusal(run(command(url, with({"--rate", "1"}))), 2, "--rate");
  expect_refusal(run(command(url, with({"--views-per-second", "0"}))), 2, "--views-per-second");
  expect_refusal(run(command(url, with({"--reconnect", "5"}))), 2, "--verify");
  expect_refusal(run(command(url, with({"--depth-maps"}))), 2, "--verify");
  expect_refusal(run(command(url, with({"--depth-maps", "--verify", "--scenario", "full"}))), 2, "--scenario full");
  expect_refusal(run(command("ws://127.0.0.1:1", good)), 2, "NAME");
  expect_refusal(run(command("http://127.0.0.1:1/x", good)), 2, "ws://");
}

}  // namespace
}  // namespace intervale
