// A running server: its ports, threads and sessions.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/memory.h"
#include "server/serve/options.h"

namespace intervale {

class FairScheduler;
class ScaleDemand;

class Server {
 public:
  // Listens, and serves on its own threads. Not ready (503) until offer() is called. Failures: an address that is
  // malformed or cannot be bound; a viewer, tokens or a certificate that cannot be read.
  static Result<std::unique_ptr<Server>> start(const ServeOptions& options);

  void offer(Catalogue catalogue);  // for new sessions; running sessions keep the data set they opened. Any thread.
  ~Server();                        // calls stop()
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Reloads the tokens and the certificate if their files have changed. If that fails, it is logged, and the previous
  // ones stay in use. One thread at a time.
  void reload();

  // As long as the server.
  [[nodiscard]] Memory& memory();                        // what it holds
  [[nodiscard]] ScaleDemand* scale_demand();             // of its sessions; nullptr without options.on_demand
  [[nodiscard]] const FairScheduler& scheduler() const;  // of its sessions
  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::uint16_t metrics_port() const;  // port() if /metrics has no port of its own
  [[nodiscard]] std::string url() const;             // "http://127.0.0.1:8080/"

  // Drains: /readyz answers 503, new sessions are refused, running sessions are closed with 1001. Returns once all
  // connections are closed, after options.drain_time at the latest; connections that are left then are closed at
  // once. A second call does nothing. Not from one of the server's own threads.
  void stop();

 private:
  struct Running;  // keeps Asio out of this header
  explicit Server(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace intervale
