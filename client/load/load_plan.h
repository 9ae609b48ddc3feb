// What the clients of a load are to do, and how far they are.
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

inline constexpr std::chrono::milliseconds kLate{5};  // a view sent later than this is a late one
inline constexpr std::chrono::seconds kGrace{2};      // after the duration, for answers on their way

struct LoadPlan {
  ServerUrl url;
  std::shared_ptr<const TlsContext> tls;  // if the URL says so
  Description description;                // of the data set: every client is to be told the same
  CameraPath path;                        // with the run's seed, from which the clients' are made
  unsigned clients = 1;
  LoadClock::time_point start;  // of the first client
  LoadClock::duration duration{};
  LoadClock::duration ramp{};           // the clients' starts are spread over it evenly
  std::optional<std::uint64_t> rate;    // bytes a second that a client reads, at least 1024; off: as fast as they come
  std::optional<std::uint64_t> window;  // most credit that a client has outstanding; see CreditWindow
  LoadClock::duration patience{};       // to be connected, for the WebSocket's handshake and for closing: each
  bool verify = false;                  // apply what comes
  Budget budget;                        // each client's, if it applies
  // How long a client looks for a server again that it has lost; off: it has failed. Wants verify: one that applies nothing has nothing to resume
  // with.
  std::optional<LoadClock::duration> reconnect;
  [[nodiscard]] LoadClock::time_point end() const { return start + duration; }
};

// How far a run has come, for who watches it from another thread.
struct LoadProgress {
  std::atomic<std::uint64_t> connected = 0;  // now
  std::atomic<std::uint64_t> updates = 0;
  std::atomic<std::uint64_t> bytes = 0;
};

}  // namespace intervale
