// Accepts connections. Internal to server/serve: brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/util/result.h"
#include "server/serve/connection_executor.h"
#include "server/serve/context.h"
#include "server/serve/http_routes.h"

namespace intervale {

// "127.0.0.1:8080", "[::1]:8080". No host names, which may stand for several addresses.
Result<boost::asio::ip::tcp::endpoint> parse_endpoint(const std::string& text);

// One port. Accepts until the threads stop. Created and destroyed on any thread, while they do not run.
class Listener {
 public:
  static Result<std::unique_ptr<Listener>> open(ConnectionThreads& threads, const std::string& address, ServerContext& context, PortRole role);

  void start();  // accepts from now on
  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }

 private:
  // Throws if the endpoint cannot be bound.
  Listener(ConnectionThreads& threads, const boost::asio::ip::tcp::endpoint& endpoint, ServerContext& context, PortRole role);
  boost::asio::awaitable<void> accept_all();
  void admit(boost::asio::ip::tcp::socket socket, ConnectionPayerPtr payer);

  ConnectionThreads& threads_;
  boost::asio::ip::tcp::acceptor acceptor_;  // on a strand of its own
  boost::asio::ip::tcp::endpoint endpoint_;  // with the port that the system chose for 0
  ServerContext& context_;
  PortRole role_;
};

}  // namespace intervale
