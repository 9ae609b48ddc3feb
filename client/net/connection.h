// A WebSocket to a server, one message at a time. Blocks, never for longer than its deadlines.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>

#include "client/net/url.h"
#include "common/util/result.h"
#include "protocol/messages.h"

namespace intervale {

inline constexpr std::chrono::seconds kConnectTime{5};   // to reach the server, and then for it to answer
inline constexpr std::chrono::seconds kSilenceTime{30};  // pings unanswered: the server is gone

// The server wants a token, or another one.
[[nodiscard]] Error unauthorized(const ServerUrl& url);

// The server answered 503 with that body: its first line, cut at 80 bytes, says why, unless it is a page (of some proxy's).
[[nodiscard]] Error turned_away(const ServerUrl& url, std::string_view body);

// One thread at a time. Every error says which server it is about.
class StreamConnection {
 public:
  static Result<StreamConnection> open(const ServerUrl& url);
  StreamConnection(StreamConnection&&) noexcept;
  StreamConnection& operator=(StreamConnection&&) noexcept;
  ~StreamConnection();  // cuts the connection, if close() did not end it

  Result<void> send(const protocol::ClientMessage& message);

  // The next message. The server's going away, a fault and a message that makes no sense are errors, after which nothing else is to be called.
  Result<protocol::ServerMessage> receive();

  // Whether the last error was the line's or the server's end, so that connecting again may help; false for faults and nonsense.
  [[nodiscard]] bool is_lost() const;

  void close();  // in order, with code 1000; waits for the server's answer at most kConnectTime

  [[nodiscard]] std::uint64_t bytes_received() const;  // of messages received, without WebSocket's framing
  [[nodiscard]] std::uint64_t messages() const;        // received

 private:
  struct Socket;  // keeps Beast out of this header
  explicit StreamConnection(std::unique_ptr<Socket> socket);
  std::unique_ptr<Socket> socket_;
};

}  // namespace intervale
