// What a server can be told.
#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "protocol/limits.h"

namespace intervale {

struct ServeOptions {
  std::string listen = "127.0.0.1:8080";                                // address:port, an IPv6 address in brackets; port 0 takes any free one
  std::optional<std::string> metrics_listen;                            // where /metrics is answered instead, for those who watch
  std::optional<std::filesystem::path> viewer;                          // folder of the browser's viewer, see StaticFiles; off: none
  unsigned threads = 0;                                                 // 0: one for each core
  std::size_t max_connections = 4096;                                   // more than these are turned away at once; keep below the limit on open files
  std::chrono::milliseconds handshake_time = protocol::kHandshakeTime;  // from a WebSocket's start to its Open
  std::chrono::milliseconds stall_time = protocol::kStallTime;          // how long updates wait for credit
  std::chrono::milliseconds drain_time{5000};                           // how long stop() waits for clients to take their leave
};

}  // namespace intervale
