// Crowds that come and leave: whoever comes afterwards finds the server as it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/programs.h"
#include "tests/support/raw_client.h"
#include "tests/support/serving.h"
#include "tests/support/temp_dir.h"

namespace intervale {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

bool within(std::chrono::steady_clock::duration time, const std::function<bool()>& holds) {
  const auto begun = std::chrono::steady_clock::now();
  return eventually(holds) && std::chrono::steady_clock::now() - begun < time;
}

TEST(Crowds, WhenTheyHaveLeftOthersComeIn) {
  ServerProgram server(buckyball().string(), {"--max-memory", "1MB"});
  std::vector<std::unique_ptr<Waiting>> crowd;
  crowd.reserve(5);
  for (int i = 0; i < 5; ++i) crowd.push_back(std::make_unique<Waiting>(server.port()));
  std::vector<std::unique_ptr<RawClient>> more;
  more.reserve(200);
  try {
    while (more.size() < 200) more.push_back(std::make_unique<RawClient>(server.port()));
  } catch (const std::exception&) {  // refused
  }
  EXPECT_LT(more.size(), 200u);
  EXPECT_THAT(get(server.port(), "/readyz"), AllOf(StartsWith("HTTP/1.1 503"), HasSubstr("full")));
  EXPECT_THAT(get(server.port(), "/healthz"), StartsWith("HTTP/1.1 200"));
  crowd.clear();
  more.clear();
  EXPECT_TRUE(within(std::chrono::seconds(1), [&] { return upgrade_status(server.port(), {}) == 101; }));
  EXPECT_THAT(get(server.port(), "/readyz"), StartsWith("HTTP/1.1 200"));
}

TEST(Crowds, WhenTheyHaveLeftTheMemoryIsBack) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitizer keeps freed memory";
#endif
  const TempDir folder;
  const std::string volume = folder / "gyroid.nrrd", made = folder / "gyroid.ivm";
  ASSERT_EQ(run({program("intervale"), "sample", "gyroid", "-o", volume}).status, 0);
  ASSERT_EQ(run({program("intervale"), "build", volume, "-o", made, "--range", "-0.5", "0.5"}).status, 0);
  ServerProgram server(made);
  const auto resident = [&] { return metric(server.port(), "intervale_resident_memory_bytes"); };
  const auto counted = [&] { return metric(server.port(), "intervale_memory_bytes{holder=\"sessions\"}"); };
  const double before = resident();
  Process load(
      {program("intervale-load"), server.url("gyroid"), "--clients", "330", "--duration", "3", "--scenario", "full", "--ramp", "0", "--json"});
  double most = 0, most_counted = 0;
  while (metric(server.port(), "intervale_sessions_total") < 330 || metric(server.port(), "intervale_sessions") > 0) {
    most = std::max(most, resident());
    most_counted = std::max(most_counted, counted());
  }
  EXPECT_EQ(load.wait().status, 0);
  EXPECT_GT(most_counted, 0.5 * (most - before)) << "sessions are counted";
  EXPECT_TRUE(within(std::chrono::seconds(10), [&] { return resident() < before + (32 << 20); })) << resident() - before;
  EXPECT_EQ(upgrade_status(server.port(), {}), 101u);
  EXPECT_TRUE(eventually([&] { return counted() < 64 << 10; })) << "what remains are the connections that ask";
}

// Of a client that rests little but what it has is kept, and nothing of that is sent again.
TEST(Crowds, WhoRestsTakesLessMemory) {
  ServerProgram server(buckyball().string());
  const auto counted = [&] { return metric(server.port(), "intervale_memory_bytes{holder=\"sessions\"}"); };
  const auto view = [](std::uint64_t epoch, double percent) {
    Lod lod;
    lod.error_percent = percent;
    return protocol::View{.epoch = epoch, .lod = lod};
  };
  RawClient client(server.port()), other(server.port());
  for (RawClient* const one : {&client, &other}) one->send(protocol::Open{"buckyball", "test", protocol::kDefaultWindow});
  client.send(view(1, 5));
  const std::uint64_t coarse = client.stream_to_end();
  const double awake = counted();
  EXPECT_TRUE(eventually([&] { return counted() < awake - 1024; })) << awake;
  client.send(view(2, 0));
  const std::uint64_t more = client.stream_to_end();
  other.send(view(1, 0));
  EXPECT_EQ(coarse + more, other.stream_to_end());
}

}  // namespace
}  // namespace intervale
