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
  std::chrono::duration<double> ramp{1};  // at most the duration counts
  Scenario scenario = Scenario::orbit;
  double views_per_second = 5;
  double pixel_error = 2;
  std::uint64_t seed = 1;
  std::optional<std::uint64_t> rate;           // see LoadPlan
  std::optional<std::uint64_t> window;         // off: adapts to the connection
  std::chrono::duration<double> patience{10};  // see LoadPlan
  unsigned threads = 1;
  // Keep a mesh for each client, and compare them at the end: see verify_meshes.
  bool verify = false;
  Budget budget;                                           // of each of these meshes
  std::optional<std::chrono::duration<double>> reconnect;  // see LoadPlan
};

// Asks the server for the description, runs the clients, and compares meshes. Blocks for the duration and up to kGrace
// and the patience. Fails if the run is not possible: no server, no such data set, too few open files allowed. Clients
// that fail later and meshes that differ are in the report.
[[nodiscard]] Result<LoadReport> run_load(const ServerUrl& url, const LoadOptions& options);

}  // namespace intervale
