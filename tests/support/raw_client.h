// A WebSocket that sends whatever a test wants, allowed or not. Blocks; the test's own time-out is the deadline.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "protocol/messages.h"

namespace intervale {

class RawClient {
 public:
  struct Hello {
    std::string subprotocols = protocol::kSubprotocol;
    std::string authorization = {}, origin = {}, forwarded_for = {};  // headers; empty: none
    bool narrow = false;                                              // as little as can be is on its way to it
  };
  // With the handshake done. Throws if it is refused.
  explicit RawClient(std::uint16_t port) : RawClient(port, Hello{}) {}
  RawClient(std::uint16_t port, const Hello& hello);
  ~RawClient();

  void send(const protocol::ClientMessage& message);
  void send_binary(std::span<const std::uint8_t> bytes, bool last = true);  // one frame
  void send_text(const std::string& text);

  void reset();  // breaks the connection off without a word, TCP's included; the last call

  // The next message, or nothing once the server has closed.
  std::optional<protocol::ServerMessage> receive();
  template <class Message>
  Message expect() {
    return std::get<Message>(receive().value());
  }

  struct End {
    unsigned code = 0;                     // the WebSocket's close code; 0: the connection broke
    std::optional<protocol::Fault> fault;  // what was said before it
  };
  End end();  // receives until the server has closed

  // Takes batches and grants what they cost, until Done; the updates that came.
  std::uint64_t stream_to_end();

 private:
  struct Socket;
  std::unique_ptr<Socket> socket_;
};

// The status that the server answers an upgrade with; 101: it is accepted.
unsigned upgrade_status(std::uint16_t port, const RawClient::Hello& hello);

// Sends bytes over plain TCP, so many at once, and gives what comes back until the server closes.
[[nodiscard]] std::string talk(std::uint16_t port, const std::string& bytes, std::size_t piece = std::string::npos);

// Sends bytes over plain TCP and that they are all, and gives what comes back until the server closes.
[[nodiscard]] std::string say_all(std::uint16_t port, const std::string& bytes);

}  // namespace intervale
