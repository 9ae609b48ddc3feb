// A stream without I/O, for programs that have a network of their own: bytes of messages in, bytes of messages and a mesh
// out. The protocol is PROTOCOL.md's.
//
// Open a WebSocket to kStreamPath with the subprotocol kStreamProtocol, call connected(), and pass each binary message
// that arrives to receive(). After each call send what take_messages() returns, in order. When the connection is lost, call
// disconnected(), open another one and go on: what was received stays.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/api/data_set_info.h"
#include "common/api/mesh_request.h"
#include "common/mesh/mesh.h"
#include "common/util/export.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr const char* kStreamProtocol = "intervale.v1";
inline constexpr const char* kStreamPath = "/v1/stream";

// On one thread.
class INTERVALE_EXPORT Session {
 public:
  using Message = std::vector<std::uint8_t>;

  // request: what is wanted first. client: name and version of the program, for the server's log. Fails as
  // check_request() does.
  [[nodiscard]] static Result<Session> start(std::string data_set, const MeshRequest& request, std::string client = "");
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  // What is wanted from now on. Fails, and changes nothing, if the data set is known and has not all of it.
  [[nodiscard]] Result<void> look(const MeshRequest& request);

  void connected();
  void disconnected();
  // Everything in the message is checked. After an error, may_reconnect() tells whether another connection can help; if
  // not, this object must not be used again.
  [[nodiscard]] Result<void> receive(std::span<const std::uint8_t> message);
  [[nodiscard]] std::vector<Message> take_messages();  // those to be sent

  [[nodiscard]] bool may_reconnect() const;
  // All that the last look() wants is here, or all that there is room for.
  [[nodiscard]] bool is_done() const;
  [[nodiscard]] std::optional<DataSetInfo> info() const;  // none before the server's first message
  // Grows with the messages. 0 before the server's first message.
  [[nodiscard]] std::uint64_t updates() const;
  // With what is here; conforming. Empty before the server's first message. O(tetrahedra).
  [[nodiscard]] Mesh mesh() const;

 private:
  struct State;
  explicit Session(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace intervale
