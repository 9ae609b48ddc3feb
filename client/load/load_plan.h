// What the clients of a load do, and their progress.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "client/core/stream_client.h"
#include "client/load/camera_paths.h"
#include "client/net/url.h"
#include "common/patch/description.h"

namespace intervale {

class TlsContext;

using LoadClock = std::chrono::steady_clock;

inline constexpr std::chrono::milliseconds kLate{5};  // a view sent so much after it was due counts as late

struct LoadOptions {
  unsigned clients = 0;  // at least 1
  LoadClock::duration duration{};
  LoadClock::duration grace = std::chrono::seconds(2);  // after the duration: how long answers are awaited
  LoadClock::duration ramp = std::chrono::seconds(1);   // the starts of the clients are spread evenly over it, at most over the duration
  Scenario scenario = Scenario::orbit;
  double views_per_second = 5;
  double pixel_error = 2;
  std::uint64_t seed = 1;               // of the run; the seeds of the clients derive from it
  std::optional<std::uint64_t> rate;    // bytes a second that a client reads, at least 1024; off: no limit
  std::optional<std::uint64_t> window;  // the most outstanding credit of a client; off: adapts to the connection
  // The longest time to connect, to do the WebSocket handshake, and to close: each.
  LoadClock::duration patience = std::chrono::seconds(10);
  unsigned threads = 1;
  // Keep a mesh for each client, and compare them at the end: see verify_meshes.
  bool verify = false;
  Budget budget;       // of each of these meshes
  RangeRequest shown;  // of the data set; ranges are needed if it has every range
  // Tell the server what the mesh of each client hides, as the viewer does. Requires verify, and a scenario with cameras.
  bool depth_maps = false;
  // How long a client tries to reach a lost server again; off: the client has failed. Requires verify: without a mesh
  // there is nothing to resume with.
  std::optional<LoadClock::duration> reconnect;
};

struct LoadPlan : LoadOptions {
  ServerUrl url;
  std::shared_ptr<const TlsContext> tls;  // with wss://
  Description description;                // of the data set; each client must receive the same
  LoadClock::time_point start;            // of the first client
  [[nodiscard]] LoadClock::time_point end() const { return start + duration; }
};

// The progress of a run, to be read by another thread.
struct LoadProgress {
  std::atomic<std::uint64_t> connected = 0;  // now
  std::atomic<std::uint64_t> updates = 0;
  std::atomic<std::uint64_t> bytes = 0;
};

}  // namespace intervale
