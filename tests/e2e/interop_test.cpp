// Clients that share no code with ours hold every conversation that PROTOCOL.md allows, and some that it does not.
#include <gtest/gtest.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "tests/support/programs.h"

namespace intervale {
namespace {

constexpr const char* kWs = "/usr/share/nodejs/ws/index.js";

bool is_there(const char* file) { return ::access(file, R_OK) == 0; }

// Runs a peer of tests/e2e/peers with the server's port, the data set's name, and more. What goes wrong it says on
// stdout, a line each.
void expect_to_understand(std::vector<std::string> peer, const std::string& more) {
  ServerProgram server;
  peer.back() = INTERVALE_E2E "/peers/" + peer.back();
  peer.insert(peer.end(), {std::to_string(server.port()), "buckyball", more});
  const Finished finished = run(peer);
  EXPECT_EQ(finished.status, 0);
  EXPECT_EQ(finished.out, "");
  EXPECT_EQ(finished.err, "");
  EXPECT_EQ(run({program("intervale-client"), "list", server.url()}).status, 0) << "the server did not outlive it";
}

TEST(Interop, PythonWebsockets) {
  if (!is_there(kPython) || run({kPython, "-c", "import flatbuffers, websockets"}).status != 0) {
    GTEST_SKIP() << "no python3-websockets and python3-flatbuffers here";
  }
  expect_to_understand({kPython, "talk.py"}, INTERVALE_SCHEMA);
}

TEST(Interop, NodeWs) {
  if (!is_there(kWs) || run({"/usr/bin/env", "node", "--version"}).status != 0) GTEST_SKIP() << "no node-ws here";
  expect_to_understand({"/usr/bin/env", "node", "talk.mjs"}, kWs);
}

}  // namespace
}  // namespace intervale
