// A whole load run: from a URL and options to stats.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "client/core/stream_client.h"
#include "client/load/camera_paths.h"
#include "client/load/load_stats.h"
#include "client/net/url.h"
#include "common/util/result.h"
#include "protocol/limits.h"

namespace intervale {

struct LoadOptions {
  unsigned clients = 0;  // at least 1
  std::chrono::duration<double> duration{};
  std::chrono::duration<double> ramp{1};  // within the duration; a longer one is cut to it
  Scenario scenario = Scenario::orbit;
  double views_per_second = 5;
  double pixel_error = 2;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> rate;           // see LoadPlan
  std::optional<std::uint64_t> window;         // off: goes by the line
  std::chrono::duration<double> patience{10};  // to be connected, and then for the WebSocket's handshake
  unsigned threads = 1;
  bool verify = false;                                     // keeps a mesh for each client, and compares them all at the end: see verify_meshes
  Budget budget;                                           // of each of those
  std::optional<std::chrono::duration<double>> reconnect;  // see LoadPlan
};

// Asks the server about the data set, runs the clients, and compares. Blocks for the duration and a little. Fails where the run could not be made: no
// server, no such data set, too few files allowed. Clients that fail later and meshes that differ are in the report.
[[nodiscard]] Result<LoadReport> run_load(const ServerUrl& url, const LoadOptions& options);

}  // namespace intervale
