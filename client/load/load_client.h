// The clients of a load: each a WebSocket that asks for views by its own timetable and measures what it gets.
//
// Latencies are free of coordinated omission. A client connects at a time fixed before the run; its view k is due k periods after its WebSocket was
// opened, however slow the server is, and its latency counts from that time, not from when it could be sent. A view that is replaced before it was
// served counts until the first message for a view as new or newer. What is unanswered when the duration is over is waited for kGrace more, and then
// counts with the time it has waited.
//
// A client that has lost its server, if the plan says so, looks for one again and resumes with what it has; its views go on being due meanwhile.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "client/core/stream_client.h"
#include "client/load/camera_paths.h"
#include "client/load/figures.h"
#include "client/net/url.h"
#include "common/description.h"

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
  std::optional<std::uint64_t> window;  // most credit that a client has outstanding; see Grants
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

// Runs clients number `first`, `first + step`, … of the plan on this thread, until the last has closed: at most kGrace and the plan's patience after
// its end. meshes: a place for each of the plan's clients, filled if the plan says verify, left empty where a batch did not apply; other threads may
// fill other places meanwhile. Throws where the machine fails, the host cannot be found for one.
[[nodiscard]] LoadFigures run_clients(const LoadPlan& plan, unsigned first, unsigned step, std::span<std::optional<StreamClient>> meshes,
                                      LoadProgress& progress);

}  // namespace intervale
