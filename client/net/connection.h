// A WebSocket to a server. Blocks, never for longer than its deadlines.
#pragma once

#include <chrono>
#include <memory>
#include <string_view>

#include "client/core/client_session.h"
#include "client/net/url.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr std::chrono::seconds kConnectTime{5};   // to connect, and then for the WebSocket's handshake
inline constexpr std::chrono::seconds kSilenceTime{30};  // without an answer to pings; then the server is lost

// The server requires a token, or another one.
[[nodiscard]] Error unauthorized(const ServerUrl& url);

// The server answered 503 with that body. Its first line, cut at 80 bytes, says why, unless it is HTML (from a proxy).
[[nodiscard]] Error turned_away(const ServerUrl& url, std::string_view body);

// The connection of one session at a time, on one thread but for wake(). Every error names the server. After one, only
// is_lost() may be called.
class StreamConnection {
 public:
  static Result<StreamConnection> open(const ServerUrl& url);
  StreamConnection(StreamConnection&&) noexcept;
  StreamConnection& operator=(StreamConnection&&) noexcept;
  ~StreamConnection();  // cuts the connection, if close() did not end it

  // Sends what the session has to send.
  Result<void> send(ClientSession& session);

  // Waits for the next message, passes it to the session, and sends what that has to send then. Event::none once `until` is
  // over; what arrives later is for the next call.
  Result<ClientSession::Event> receive(ClientSession& session, ClientSession::Clock::time_point until = ClientSession::Clock::time_point::max());

  // From any thread: a receive() that waits, or else the next one, returns Event::none. What arrives meanwhile is not lost.
  void wake();

  // Whether the last error was the end of the connection or of the server, so that connecting again may help.
  [[nodiscard]] bool is_lost() const;

  void close();  // in order, with code 1000; waits for the server's answer at most kConnectTime

 private:
  struct Socket;  // keeps Beast out of this header
  explicit StreamConnection(std::unique_ptr<Socket> socket);
  std::unique_ptr<Socket> socket_;
};

}  // namespace intervale
