// The options of a server.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "protocol/limits.h"
#include "server/serve/accounts.h"

namespace intervale {

class ScratchMemory;

// PEM files.
struct TlsFiles {
  std::filesystem::path certificate, key;  // the certificate with its chain, and its private key
};

struct ServeOptions {
  std::string listen = "127.0.0.1:8080";                   // IPv6 addresses in brackets; port 0: any free port
  std::optional<std::string> metrics_listen;               // a port of its own for /metrics; nullopt: on the main port
  std::optional<std::filesystem::path> viewer;             // folder of the viewer, see StaticFiles; nullopt: none
  bool tolerates_damage = false;                           // serves what is left of files with damaged pages (page_faults.h)
  bool on_demand = false;                                  // finer scales of large files are read when views want them
  std::chrono::milliseconds keep_time{600'000};            // and dropped when no session has used them for so long
  unsigned threads = 0;                                    // 0: one for each core
  std::optional<std::filesystem::path> tokens;             // file, see Tokens; nullopt: no token is required
  std::vector<std::string> allowed_origins;                // that may open sessions; empty: the request's host
  std::vector<std::string> connect_origins;                // besides the server, that its page may read files of: is_connect_origin()
  TrustedProxies proxies;                                  // whose X-Forwarded-For is believed
  std::optional<TlsFiles> tls;                             // nullopt: plain HTTP and WebSocket
  std::size_t max_connections = 4096;                      // further ones take the place of those that wait for their client
  std::optional<std::size_t> max_connections_per_address;  // at least 1; further ones are closed at once
  std::optional<std::size_t> max_sessions;                 // further ones are answered 503
  std::optional<std::uint64_t> max_memory;                 // bytes that Memory counts; no new sessions above: 503
  ScratchMemory* data_memory = nullptr;                    // installed, where data sets lie; it must outlive the server
  std::size_t max_queued_bytes = 512 << 20;                // unsent bytes of all sessions, see WriteBudget
  double messages_per_second = 2000;                       // of each session; further ones are delayed
  double views_per_second = 200;                           // views among those messages: the same

  std::chrono::milliseconds handshake_time = protocol::kHandshakeTime;  // for a request; for Open after the upgrade
  std::chrono::milliseconds stall_time = protocol::kStallTime;          // for credit, while there are updates to send
  std::chrono::milliseconds write_time = protocol::kWriteTime;          // for sending one message
  std::chrono::milliseconds idle_time = protocol::kIdleTime;            // without any frame or pong
  std::chrono::milliseconds drain_time{5000};                           // for clients to disconnect in stop()
};

}  // namespace intervale
