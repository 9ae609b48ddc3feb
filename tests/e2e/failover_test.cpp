// Replicas behind a real balancer, with the configuration that deploy/ has for it. A session's whole state is what its
// client brings, so the one takes over from the other.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/net/http_get.h"
#include "client/net/url.h"
#include "tests/support/free_ports.h"
#include "tests/support/programs.h"
#include "tests/support/serving.h"

namespace intervale {
namespace {

std::optional<std::string> haproxy() {
  for (const char* path : {"/usr/sbin/haproxy", "/usr/local/sbin/haproxy", "/usr/bin/haproxy"}) {
    if (::access(path, X_OK) == 0) return path;
  }
  return {};
}

std::string loopback(std::uint16_t port) { return "127.0.0.1:" + std::to_string(port); }

// haproxy before two servers.
class Balancer {
 public:
  Balancer(const std::string& haproxy, const ServerProgram& a, const ServerProgram& b)
      : ports_(free_ports<2>()),
        process_({"/usr/bin/env", "INTERVALE_BIND=" + loopback(ports_[0]), "INTERVALE_BALANCER_METRICS=" + loopback(ports_[1]),
                  "INTERVALE_A=" + loopback(a.port()), "INTERVALE_B=" + loopback(b.port()), haproxy, "-db", "-f",
                  (INTERVALE_DEPLOY "/haproxy.cfg")}) {}
  [[nodiscard]] std::string url(const std::string& name) const { return "ws://" + loopback(ports_[0]) + "/" + name; }
  [[nodiscard]] bool answers() const { return http_get(*parse_url(url("")), "/readyz").has_value(); }

 private:
  std::array<std::uint16_t, 2> ports_;
  Process process_;
};

class Failover : public ::testing::TestWithParam<int> {};

#ifdef __SANITIZE_ADDRESS__
constexpr int kClients = 20;  // the harness is several times as slow
constexpr const char* kSeconds = "20";
#else
constexpr int kClients = 100;
constexpr const char* kSeconds = "16";
#endif

// SIGKILL: a replica that is there no more. SIGTERM: one that sends its clients elsewhere.
TEST_P(Failover, EveryClientGoesOnAtTheOtherReplica) {
  const auto installed = haproxy();
  if (!installed) GTEST_SKIP() << "no haproxy here";
  ServerProgram a, b;
  const auto whole = nlohmann::json::parse(run({program("intervale-client"), "fetch", a.url("buckyball"), "--json"}).out, nullptr, false);
  const double sent_before = metric(a.port(), "intervale_bytes_sent_total");
  const Balancer balancer(*installed, a, b);
  ASSERT_TRUE(eventually([&] { return balancer.answers(); }));
  Process load({program("intervale-load"), balancer.url("buckyball"), "--clients", std::to_string(kClients), "--duration", kSeconds, "--ramp", "1",
                "--pixel-error", "6", "--verify", "--reconnect", "10", "--json"});
  const double views = 10 * kClients;  // of half of the clients: the first meshes have come, and with them most of what is sent at once
  ASSERT_TRUE(eventually([&] { return metric(a.port(), "intervale_view_change_seconds_count") >= views; }));
  const double streams = metric(a.port(), "intervale_sessions"), sent_by_a = metric(a.port(), "intervale_bytes_sent_total") - sent_before;
  a.process().signal(GetParam());
  const Finished finished = load.wait();
  EXPECT_EQ(finished.status, 0) << finished.err;
  const auto figures = nlohmann::json::parse(finished.out, nullptr, false);
  EXPECT_EQ(figures.at("connected"), kClients);
  EXPECT_EQ(figures.at("failed"), 0) << figures;
  EXPECT_EQ(figures.at("verified"), kClients);
  EXPECT_EQ(figures.at("differing"), 0);
  EXPECT_GE(streams, 0.4 * kClients);
  EXPECT_GE(figures.at("reconnects"), streams);
  EXPECT_LE(figures.at("resume_ms").at("max"), 2000.0) << figures.at("resume_ms");
  EXPECT_EQ(figures.at("repeated_updates"), 0);
  // What clients had twice, and what was sent but had not come when the replica went, so that the other one sent it
  // again. Before the clients came one that asked for a description, and one for the whole stream to compare with.
  const double received = figures.at("bytes"), repeated = figures.at("repeated_bytes"), asked = whole.at("bytes_received");
  const double sent = sent_by_a + metric(b.port(), "intervale_bytes_sent_total") - asked;
  EXPECT_LE(repeated + std::max(0.0, sent - received), 0.02 * received) << sent << " sent, " << received << " received, " << repeated << " twice";
  std::cout << "  " << figures.at("reconnects") << " resumed, ms: " << figures.at("resume_ms") << "; B received " << received << ", twice "
            << repeated << ", sent " << sent << ", to say what clients had " << figures.at("resume_bytes") << "\n";
}

INSTANTIATE_TEST_SUITE_P(Failover, Failover, ::testing::Values(SIGKILL, SIGTERM),
                         [](const auto& signal) { return std::string(signal.param == SIGKILL ? "Killed" : "Drained"); });

}  // namespace
}  // namespace intervale
