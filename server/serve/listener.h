// Takes connections in. Internal to server/serve: brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/util/result.h"
#include "server/serve/context.h"
#include "server/serve/http_routes.h"

namespace intervale {

// "127.0.0.1:8080", "[::1]:8080". No host names: what a name stands for is not for us to choose.
Result<boost::asio::ip::tcp::endpoint> parse_endpoint(const std::string& text);

// One port. Created and destroyed on any thread; close() may be called from any.
class Listener {
 public:
  static Result<std::unique_ptr<Listener>> open(boost::asio::io_context& io, const std::string& address, ServerContext& context, Door door);

  void start();  // accepts from now on, until close()
  void close();  // nobody new; takes effect soon
  [[nodiscard]] boost::asio::ip::tcp::endpoint endpoint() const { return endpoint_; }

 private:
  Listener(boost::asio::io_context& io, ServerContext& context, Door door);
  boost::asio::awaitable<void> accept_all();
  std::optional<AddressCounts::Seat> seat_for(const boost::asio::ip::tcp::socket& socket);  // nothing: too many from there

  boost::asio::io_context& io_;
  boost::asio::ip::tcp::acceptor acceptor_;  // on a strand of its own
  boost::asio::ip::tcp::endpoint endpoint_;
  ServerContext& context_;
  Door door_;
};

}  // namespace intervale
