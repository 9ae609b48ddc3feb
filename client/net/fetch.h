// A whole stream: from a URL and a level of detail to a mesh.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/core/client_session.h"
#include "client/net/url.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct FetchOptions {
  Lod lod;
  RangeRequest shown;                 // of the data set; ranges are needed if it has every range
  std::vector<std::string> channels;  // of the data set, that the meshes bring along
  // Where `shown` does not say what to refine: the inside of the ranges too, if the data set has it.
  bool prefers_uniform = false;
  // Surfaces hide what is behind them: what the lod's camera does not see is received last.
  bool is_opaque = false;
  // The most bytes of messages that are received; only the first one, the description, may exceed it. No updates
  // arrive for less than that message and protocol::kMinCredit.
  std::optional<std::uint64_t> max_bytes;
  std::chrono::seconds reconnect{30};  // how long to try to reach a lost server again; 0: not at all
};

struct FetchStats {
  ClientSession::Stats session;   // over all connections
  double seconds_first_mesh = 0;  // until the mesh first had a tetrahedron; 0 if it never had
  double seconds = 0;             // from the start to the end of the stream
  bool is_complete = false;       // everything that was asked for arrived; false: a budget ended the stream
};

struct Fetched {
  StreamClient client;
  FetchStats stats;
};

struct FetchEvents {
  // After each batch; the stream's seconds are not known yet.
  std::function<void(const StreamClient&, const FetchStats&)> on_batch;
  // One line that the user should read; the stream goes on.
  std::function<void(const std::string&)> on_notice;
};

// Connects, and receives until everything has arrived or a budget is reached. When the server is lost, connects again
// after the pauses of Backoff, and resumes; if the data changed, starts again. Every other failure is an error that
// names the server.
Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events);

}  // namespace intervale
