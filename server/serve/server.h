// A running server: a port, threads, and the sessions on it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/util/result.h"
#include "server/serve/catalogue.h"
#include "server/serve/options.h"

namespace intervale {

class Server {
 public:
  // Listens, and answers on threads of its own from then on: that it is not ready, until there is something to offer. Failures: an address that
  // cannot be read, or cannot be had; a viewer, tokens or a certificate that cannot be read.
  static Result<std::unique_ptr<Server>> start(const ServeOptions& options);
  static Result<std::unique_ptr<Server>> start(const ServeOptions& options, Catalogue catalogue);  // and offers that

  void offer(Catalogue catalogue);  // from now on; sessions keep what they opened. Any thread.
  ~Server();                        // stops
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Reads the tokens and the certificate again if their files have changed. What cannot be read is logged, and what was read before holds. One thread
  // at a time.
  void refresh();

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::uint16_t metrics_port() const;  // port() if it has none of its own
  [[nodiscard]] std::string url() const;             // "http://127.0.0.1:8080/"

  // Drains: not ready, which those who ask are told, no new sessions, running ones closed with 1001; returns once all are gone, after
  // options.drain_time at the latest, when what is left is cut off. A second call does nothing. Not from a thread of the server's own.
  void stop();

 private:
  struct Running;  // keeps Asio out of this header
  explicit Server(std::unique_ptr<Running> running);
  std::unique_ptr<Running> running_;
};

}  // namespace intervale
