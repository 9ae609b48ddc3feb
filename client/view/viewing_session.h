// The client's side of a session whose view changes, without I/O: bytes of messages in, bytes of messages out.
//
// A caller opens a WebSocket, calls opened_line(), hands every message to receive(), and after each call here sends what take_messages() gives, in
// order. When the line is lost it calls lost_line(), opens another one, and goes on: what came stays. Who may send what when: PROTOCOL.md.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/core/grants.h"
#include "client/core/stream_client.h"
#include "common/util/result.h"
#include "common/view/lod.h"
#include "protocol/messages.h"

namespace intervale {

// What is to be seen.
struct WantedView {
  Camera camera;              // pixel_error: how far surfaces may be off, where there is no region
  std::optional<Box> region;  // refined to the end; the rest only as far as conformity needs
  Budget budget;              // max_updates at least kLeastRoom
  friend bool operator==(const WantedView& a, const WantedView& b) {
    return a.camera == b.camera && a.region == b.region && a.budget.max_tets == b.budget.max_tets && a.budget.max_updates == b.budget.max_updates;
  }
};

class ViewingSession {
 public:
  using Clock = Grants::Clock;
  static constexpr std::uint64_t kLeastRoom = 1000;  // updates

  struct Figures {
    std::uint64_t bytes = 0;  // of messages received
    std::uint64_t messages = 0;
    std::uint64_t received = 0;  // updates; those that were given up and came again count each time
    std::uint64_t repeated = 0;  // of those, such as were there already: there are none
    std::uint64_t sessions = 0;  // that the server opened
    std::uint64_t resumed = 0;   // of those, such as went on where another one was
    // The server's word on what this view wants and has not come; bounds from above.
    double remaining_error = 0;   // field units
    double remaining_pixels = 0;  // on the camera's screen; when done, what it asked for, or 0 if nothing is left; 0 for a region
    std::uint64_t updates_to_go = 0;
    bool done = false;  // all that the view wants has come
    bool full = false;  // ... that there is room for
  };

  // client: name and version, for the server's log.
  ViewingSession(std::string dataset, std::string client) : dataset_(std::move(dataset)), client_name_(std::move(client)) {}

  // What is wanted from now on. Fails, and changes nothing, on a camera or a box that check_lod does not let pass.
  Result<void> look(const WantedView& view);

  void opened_line(Clock::time_point now);  // after the first look()
  void lost_line();

  // Takes one message. After a failure, whose text says what the server said or sent, this object must not be used again, unless fault_code() is that
  // the server goes away: then lost_line() and another line follow.
  Result<void> receive(std::span<const std::uint8_t> message, Clock::time_point now);

  [[nodiscard]] std::vector<std::vector<std::uint8_t>> take_messages() { return std::exchange(messages_, {}); }

  // The mesh; null before the first description.
  [[nodiscard]] const StreamClient* client() const { return client_ ? &*client_ : nullptr; }
  [[nodiscard]] const Figures& figures() const { return figures_; }
  // Of the last receive(): whether the server opened the session, and whether the mesh was begun afresh then.
  [[nodiscard]] bool was_opened() const { return was_opened_; }
  [[nodiscard]] bool is_fresh() const { return fresh_; }
  [[nodiscard]] protocol::CloseCode fault_code() const { return fault_code_; }  // after a failure that a Fault told; else normal

 private:
  Result<void> take(protocol::Opened& opened, Clock::time_point now);
  Result<void> take(const protocol::Batch& batch, Clock::time_point now);
  Result<void> take(const protocol::Done& done);
  Result<void> take(const protocol::Fault& fault);
  [[nodiscard]] Lod lod() const;
  void send(const protocol::ClientMessage& message);
  void send_view();
  void arrived(std::uint64_t epoch);
  void grant();

  std::string dataset_, client_name_;
  std::vector<std::vector<std::uint8_t>> messages_;
  std::optional<StreamClient> client_;
  std::optional<WantedView> view_;
  Grants grants_{UINT64_MAX};
  Figures figures_;
  Clock::time_point asked_;
  std::uint64_t epoch_ = 0;     // of the last view asked for; goes on from session to session
  std::uint64_t served_ = 0;    // of the last message
  std::uint64_t first_ = 0;     // of the first view of this session
  std::uint64_t sequence_ = 0;  // of the next batch
  bool has_line_ = false, is_open_ = false, was_opened_ = false, fresh_ = false;
  bool gave_up_ = false;  // for this view, once more, because there was no room
  protocol::CloseCode fault_code_ = protocol::CloseCode::normal;
};

}  // namespace intervale
