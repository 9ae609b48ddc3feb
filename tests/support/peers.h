// Stand-ins for the other side of a connection: a relay that can be told when to act, and servers that are not ours.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/messages.h"

namespace intervale {

// Passes connections on to 127.0.0.1:port, one after the other. After each piece that came from the server, and before
// it is passed on, on_bytes is called with the count of this connection's bytes so far, on the relay's thread; false
// cuts it.
class Relay {
 public:
  Relay(std::uint16_t port, std::function<bool(std::uint64_t)> on_bytes);
  ~Relay();
  [[nodiscard]] std::string url(const std::string& name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// Answers whatever comes first on a connection with `answer`, then closes; with an empty answer it keeps silent.
class Stranger {
 public:
  explicit Stranger(std::string answer);
  ~Stranger();
  [[nodiscard]] std::string url(const std::string& name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A WebSocket server that answers the first message of each session with Fault, and closes with its code.
class Refuser {
 public:
  Refuser(protocol::CloseCode code, std::string text);
  ~Refuser();
  [[nodiscard]] std::string url(const std::string& name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// A WebSocket server that answers the first message of each session with frames that no server sends.
class Speaker {
 public:
  struct Frame {
    enum class Kind { binary, text, ping, raw } kind = Kind::binary;  // raw: bytes on the connection, no frame
    std::string bytes;
    unsigned times = 1;
  };
  // close_code: after that; 0: the connection ends without one.
  Speaker(std::vector<Frame> frames, unsigned close_code);
  ~Speaker();
  [[nodiscard]] std::string url(const std::string& name) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace intervale
