// The connection of a client of a load, which may be lost and opened again. Internal to client/load: brings in Asio.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "client/load/load_plan.h"
#include "protocol/transport/stream.h"

namespace intervale {

// One WebSocket after the other. On one thread.
class LoadConnection {
 public:
  using Endpoints = boost::asio::ip::tcp::resolver::results_type;
  using WebSocket = boost::beast::websocket::stream<Stream>;

  // All references outlive this. seed: of the pauses between attempts.
  LoadConnection(boost::asio::io_context& io, const Endpoints& endpoints, const LoadPlan& plan, std::uint64_t seed);

  // Opens the first WebSocket. Connecting and the handshake may each take the plan's patience. False: complaint() says
  // why it failed.
  boost::asio::awaitable<bool> open();
  // After lose(): opens another one in its place. It tries for LoadPlan::reconnect, which must be given. False: the
  // time is over, and complaint() is the reason given to lose().
  boost::asio::awaitable<bool> open_again();

  void lose(const std::string& why);  // and cut()
  void cut();                         // closes the socket: pending operations fail
  void give_up();                     // cut(); open_again() returns false

  [[nodiscard]] WebSocket& websocket() { return *websocket_; }               // another one after open_again()
  [[nodiscard]] const std::string& complaint() const { return complaint_; }  // why there is no connection; one line

 private:
  boost::asio::io_context& io_;
  const Endpoints& endpoints_;
  const LoadPlan& plan_;
  std::uint64_t seed_;
  std::optional<WebSocket> websocket_;  // never empty
  boost::asio::steady_timer pause_;     // between attempts
  std::string complaint_;
  bool given_up_ = false;
};

}  // namespace intervale
