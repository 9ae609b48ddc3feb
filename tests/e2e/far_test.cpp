// A server that is far away: 100 ms there and back, and two packets of a hundred lost.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/programs.h"

namespace intervale {
namespace {

// What the shell prints that runs `script` with the programs' folder and a data set as $1 and $2, in a network where
// port 8080 of 10.78.0.2 is that of a server, far away.
Finished far_away(const std::string& script) {
  const std::string around =
      "\"$1/intervale\" serve \"$2\" --listen 10.78.0.1:8080 --log-level error & server=$!; "
      "for i in $(seq 600); do \"$1/intervale-client\" list ws://10.78.0.1:8080 >/dev/null 2>&1 && break; done; " +
      script + "; status=$?; kill $server; wait $server || exit 1; exit $status";
  const std::string programs = program("intervale").substr(0, program("intervale").rfind('/'));
  return run({"/usr/bin/env", "unshare", "--map-root-user", "--net", kPython, (INTERVALE_E2E "/../support/far.py"), "0.05", "0.02", "sh", "-c",
              around, "sh", programs, buckyball()});
}

bool can_be_had() {
  return ::access(kPython, X_OK) == 0 &&
         run({"/usr/bin/env", "unshare", "--map-root-user", "--net", kPython, (INTERVALE_E2E "/../support/far.py"), "0", "0", "true"}).status == 0;
}

TEST(Far, AStreamComesWholeThroughDelayAndLoss) {
  if (!can_be_had()) GTEST_SKIP() << "no network with a far host can be had here";
  const auto near = run({program("intervale"), "extract", buckyball(), "--digest", "--json"});
  ASSERT_EQ(near.status, 0) << near.err;
  const auto digest = nlohmann::json::parse(near.out).at("digest").get<std::string>();
  const auto finished = far_away("\"$1/intervale-client\" fetch ws://10.78.0.2:8080/buckyball --digest --json --reconnect 0");
  ASSERT_EQ(finished.status, 0) << finished.err;
  EXPECT_EQ(nlohmann::json::parse(finished.out).at("digest"), digest);
}

TEST(Far, ViewsThatMoveAreServedThroughDelayAndLoss) {
  if (!can_be_had()) GTEST_SKIP() << "no network with a far host can be had here";
  const auto finished =
      far_away("\"$1/intervale-load\" ws://10.78.0.2:8080/buckyball --clients 8 --duration 4 --ramp 0 --patience 60 --verify --json");
  ASSERT_EQ(finished.status, 0) << finished.err;
  const auto figures = nlohmann::json::parse(finished.out);
  EXPECT_EQ(figures.at("connected"), 8);
  EXPECT_EQ(figures.at("failed"), 0) << figures;
  EXPECT_EQ(figures.at("verified"), 8);
  EXPECT_EQ(figures.at("differing"), 0);
  EXPECT_GE(figures.at("first_mesh_ms").at("p50"), 100.0) << "it was not far";
}

}  // namespace
}  // namespace intervale
