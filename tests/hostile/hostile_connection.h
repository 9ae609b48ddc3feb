// The connection of an attacker: TCP from a source address of its own, and a WebSocket over it. Brings in Asio.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "protocol/messages.h"

namespace intervale {

// What the attackers of a run did, and what the server did about it.
struct Tally {
  std::uint64_t connections = 0;  // TCP connections that were opened
  std::uint64_t sessions = 0;     // of those, the ones that became WebSockets
  std::uint64_t messages = 0;     // of the protocol, sent whole
  std::uint64_t answers = 0;      // Batch and Done messages
  // How the server ended connections: a close code, the HTTP status of an upgrade, or "cut"; how often.
  std::map<std::string, std::uint64_t> ends;
};

// On one thread. Its end is a TCP reset, unless the server ended the connection.
class HostileConnection {
 public:
  // tally: added to; it outlives this.
  HostileConnection(const boost::asio::any_io_executor& executor, Tally& tally) : tally_(tally), ws_(executor) {}
  HostileConnection(const HostileConnection&) = delete;
  HostileConnection& operator=(const HostileConnection&) = delete;
  ~HostileConnection() { reset(); }

  // Opens TCP. False: the system or the server refused.
  boost::asio::awaitable<bool> connect(const boost::asio::ip::tcp::endpoint& server, const boost::asio::ip::address_v4& source);
  // After connect(): the WebSocket's handshake. False: it was refused.
  boost::asio::awaitable<bool> upgrade();

  // They are false once the connection has ended. What is passed lives until they complete.
  boost::asio::awaitable<bool> send(const protocol::ClientMessage& message);
  boost::asio::awaitable<bool> send_bytes(std::span<const std::uint8_t> message);
  boost::asio::awaitable<bool> send_fragment(std::uint8_t byte);   // of a message that does not end
  boost::asio::awaitable<bool> send_raw(const std::string& text);  // over TCP
  boost::asio::awaitable<bool> send_credit();                      // what batches have cost since the last call

  // The next message, or nothing once the connection has ended.
  boost::asio::awaitable<std::optional<protocol::ServerMessage>> receive();
  // Receives until the first answer to the view of this epoch, or until its Done. Grants what batches cost. False: the
  // connection has ended.
  enum class Until : std::uint8_t { first_answer, done };
  boost::asio::awaitable<bool> receive_answer(std::uint64_t epoch, Until until);
  // Receives until the connection has ended.
  boost::asio::awaitable<void> receive_all();
  boost::asio::awaitable<void> receive_all_raw();  // over TCP

  void reset();
  [[nodiscard]] bool has_ended() const { return has_ended_; }

 private:
  void end(const std::string& how);
  Tally& tally_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> ws_;
  boost::beast::flat_buffer buffer_;
  std::uint64_t spent_ = 0;  // what batches have cost, and was not granted again
  bool has_ended_ = false;
};

}  // namespace intervale
