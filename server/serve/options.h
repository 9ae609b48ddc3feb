// What a server can be told.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/limits.h"

namespace intervale {

// PEM: the server's certificate and those that vouch for it, and its key.
struct TlsFiles {
  std::filesystem::path certificate, key;
};

struct ServeOptions {
  std::string listen = "127.0.0.1:8080";                                // address:port, an IPv6 address in brackets; port 0 takes any free one
  std::optional<std::string> metrics_listen;                            // where /metrics is answered instead, for those who watch
  std::optional<std::filesystem::path> viewer;                          // folder of the browser's viewer, see StaticFiles; off: none
  unsigned threads = 0;                                                 // 0: one for each core
  std::optional<std::filesystem::path> tokens;                          // file of those who may come in, see Tokens; off: everybody
  std::vector<std::string> allowed_origins;                             // of pages that may open sessions; none: those of the host they are sent to
  std::optional<TlsFiles> tls;                                          // off: plain HTTP and WebSocket
  std::size_t max_connections = 4096;                                   // more than these are turned away at once; keep below the limit on open files
  std::optional<std::size_t> max_connections_per_address;               // at least 1; the same
  std::optional<std::size_t> max_sessions;                              // more than these are answered 503
  std::optional<std::uint64_t> max_memory;                              // no new sessions while the process has more bytes resident: 503
  std::size_t max_queued_bytes = 512 << 20;                             // of messages that are leaving, see WriteBudget
  double messages_per_second = 2000;                                    // of each session; faster ones are read as slowly
  double views_per_second = 200;                                        // of those
  std::chrono::milliseconds handshake_time = protocol::kHandshakeTime;  // for a request, and from a WebSocket's start to its Open: each
  std::chrono::milliseconds stall_time = protocol::kStallTime;          // how long updates wait for credit
  std::chrono::milliseconds write_time = protocol::kWriteTime;          // how long one message may take to leave
  std::chrono::milliseconds idle_time = protocol::kIdleTime;            // silence, pings unanswered
  std::chrono::milliseconds drain_time{5000};                           // how long stop() waits for clients to take their leave
};

}  // namespace intervale
