// A whole stream: from a URL and a level of detail to a mesh.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/core/stream_client.h"
#include "client/net/url.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

struct FetchOptions {
  Lod lod;
  // Messages' bytes in all are never more (but for the first, the description). Nothing comes for less than that and protocol::kMinCredit.
  std::optional<std::uint64_t> max_bytes;
  // How long to try to reach a server again that was lost, with what came so far; 0: not at all.
  std::chrono::seconds reconnect{30};
};

struct FetchFigures {
  std::uint64_t bytes_received = 0;  // of messages, without WebSocket's framing
  std::uint64_t messages = 0;
  // The server's word on what is wanted and has not come; bounds from above.
  double remaining_error = 0;   // field units
  double remaining_pixels = 0;  // on the camera's screen; 0 without one
  std::uint64_t updates_to_go = 0;
  double seconds_first_mesh = 0;  // until the mesh first had a tetrahedron; 0 if it never had
  double seconds_applying = 0;    // spent on decoding batches and applying them
  double seconds = 0;             // from the start to the end of the stream
  std::uint64_t reconnects = 0;   // sessions after the first
  bool complete = false;          // all that was asked for came; false: a budget ended it
};

struct Fetched {
  StreamClient client;
  FetchFigures figures;
};

struct FetchEvents {
  std::function<void(const StreamClient&, const FetchFigures&)> on_batch;  // after every batch applied
  std::function<void(const std::string&)> on_notice;                       // what the user should know though it goes on: a line
};

// Connects, streams, applies, and stops when all has come or a budget is reached. A server that is lost in the middle is connected to again, after
// waits that double, from 0.1 s to 3 s, cut by up to a half at random; the stream goes on where it was, or afresh if the data changed. Everything
// else that goes wrong is an error that says which server.
Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options, const FetchEvents& events);

}  // namespace intervale
