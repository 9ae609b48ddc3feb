// What a server says of itself to those that watch it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "tests/support/raw_client.h"
#include "tests/support/serving.h"

namespace intervale {
namespace {

using protocol::CloseCode;
using protocol::View;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

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

}  // namespace
}  // namespace intervale
