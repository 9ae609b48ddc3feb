// A whole stream: from a URL and a level of detail to a mesh.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "client/core/stream_client.h"
#include "client/net/url.h"
#include "common/lod.h"
#include "common/result.h"

namespace intervale {

struct FetchOptions {
  Lod lod;
  // Messages' bytes in all are never more (but for the first, the description). Nothing comes for less than that and protocol::kMinCredit.
  std::optional<std::uint64_t> max_bytes;
};

struct FetchFigures {
  std::uint64_t bytes_received = 0;  // of messages, without WebSocket's framing
  std::uint64_t messages = 0;
  // The server's word on what is wanted and has not come; bounds from above.
  double remaining_error = 0;   // field units
  double remaining_pixels = 0;  // on the camera's screen; 0 without one
  std::uint64_t updates_to_go = 0;
  double seconds_first_mesh = 0;  // until the mesh first had a tetrahedron; 0 if it never had
  double seconds = 0;             // from the start to the end of the stream
  bool complete = false;          // all that was asked for came; false: a budget ended it
};

struct Fetched {
  StreamClient client;
  FetchFigures figures;
};

// Connects, streams, applies, and stops when all has come or a budget is reached. on_batch is called after every batch applied. Everything that
// goes wrong, a server that leaves in the middle too, is an error that says which server.
Result<Fetched> fetch(const ServerUrl& url, const FetchOptions& options,
                      const std::function<void(const StreamClient&, const FetchFigures&)>& on_batch);

}  // namespace intervale
