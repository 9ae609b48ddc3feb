// The client's side of intervale.v1, without I/O: bytes of messages in, bytes of messages and a mesh out. This class
// alone knows the client's rules of PROTOCOL.md: sequence, epochs, credit, resuming and forgetting.
//
// A driver opens a WebSocket, calls connected(), and passes each message that arrives to receive(). After each call it
// sends what take_messages() returns, in order. When the connection is lost, it calls disconnected(), opens another one
// and goes on: the updates received so far stay.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/core/camera_motion.h"
#include "client/core/credit_window.h"
#include "client/core/stream_client.h"
#include "common/util/result.h"
#include "common/view/depth_map.h"
#include "common/view/lod.h"
#include "protocol/messages.h"

namespace intervale {

// Whether a client that was closed with this code may find another server, or the same one later.
[[nodiscard]] bool may_reconnect(protocol::CloseCode code);

// What interactive clients ask for ahead (protocol::View::coarse_error_percent), so that a drag of a range finds something
// at once: 0.1 to 0.8 MB for volumes of 1.6 to 7.4 million samples, less what the view has of it.
inline constexpr double kCoarseErrorPercent = 10;

struct ViewRequest {
  Lod lod;  // one that check_lod accepts
  // Likewise. A mesh at its budget keeps what is largest on this camera's screen; without one, what came first.
  std::optional<Camera> camera = {};
  std::optional<Box> within = {};  // likewise, with a camera: see StreamClient::look
  Budget budget = {};
  RangeRequest shown = {};  // of the data set
  bool early = false;       // see protocol::View
  // Likewise; batches arrive while the session is idle, too.
  std::optional<double> coarse_error_percent = {};
  std::vector<std::string> channels = {};  // of the data set, whose values come along
  // Surfaces hide what is behind them: see wants_depth_map(). With a camera in `lod`.
  bool is_opaque = false;
  std::optional<DepthMap> depth = {};     // of that camera, if there is one already
  std::optional<CameraAhead> ahead = {};  // of that camera, if it moves; given up once it has rested
};

// On one thread.
class ClientSession {
 public:
  using Clock = CreditWindow::Clock;
  using Message = std::vector<std::uint8_t>;

  // As in PROTOCOL.md, "Sequence of messages".
  enum class State : std::uint8_t {
    connecting,  // there is no WebSocket: before the first one, or after it was lost
    greeted,     // Open was sent
    viewing,     // Opened arrived, and a view wants updates
    // Opened arrived, and no view wants updates: none was sent, or its Done arrived. Coarse updates may follow.
    idle,
    closed,  // the session ended, and connecting again does not help
  };

  struct Options {
    std::string dataset;
    std::string client;                           // name and version, for the server's log
    std::string server = "the server";            // its name in errors
    std::optional<std::uint64_t> max_bytes = {};  // of all messages received; only an Opened may exceed it
    std::optional<std::uint64_t> window = {};     // the most credit outstanding; off: adapts to the connection
    // False: batches are counted but not decoded, and no session is resumed.
    bool has_mesh = true;
  };

  struct Stats {
    std::uint64_t connections = 0;
    std::uint64_t messages = 0;    // received
    std::uint64_t bytes = 0;       // of those
    std::uint64_t have_bytes = 0;  // of Have messages sent
    std::uint64_t updates = 0;     // received for the mesh; those forgotten and received again count again
    std::uint64_t forgotten = 0;   // of those
    double seconds_applying = 0;   // spent on decoding and applying batches
    // The server's upper bounds on what the view wants and has not received.
    double remaining_error = 0;   // field units
    double remaining_pixels = 0;  // on the camera's screen; 0 without one
    std::uint64_t updates_to_go = 0;
    bool is_full = false;  // Done arrived, but there was no room for everything
  };

  // What a message was, after it took effect.
  struct Event {
    enum class Kind : std::uint8_t { none, opened, batch, done } kind = Kind::none;
    bool is_new_mesh = false;   // opened: the mesh starts anew; false: the session resumes the last one
    std::uint64_t epoch = 0;    // batch, done: of the view that it answers
    std::uint64_t updates = 0;  // batch: how many it has
    bool is_full = false;       // done: there was no room for everything
  };

  explicit ClientSession(Options options);

  // What is wanted from now on. Before connected(), and while there is no connection, it is only kept. Fails, and changes
  // nothing, if the data set is known and has not all that is to be shown, or not all channels.
  Result<void> look(ViewRequest request);
  // What the mesh shows until the next look(), of the updates that are here; the server is asked for nothing. Fails, and
  // changes nothing, if the data set has not all of it. Nothing happens while there is no mesh.
  Result<void> preview(const RangeRequest& shown) { return mesh_ ? mesh_->show(shown) : Result<void>(); }
  // Asks for the same view again, and gives up more: there was no room for all of it.
  void look_again() { send_view(); }

  // Whether the server should be told what the surfaces hide: the view is opaque, and the mesh has twice as many updates
  // as when it was last told.
  [[nodiscard]] bool wants_depth_map() const;
  // Asks for the same view again. map: of its camera, and of the mesh as it is.
  void send_depth_map(DepthMap map);

  // The WebSocket is open. Open, all Haves and the view are to be sent together: that saves a round trip.
  void connected(Clock::time_point now);
  void disconnected();

  // Takes one message. After an error, state() is connecting if the server ended the session and may_reconnect();
  // otherwise it is closed, and the session must not be used again.
  Result<Event> receive(std::span<const std::uint8_t> message, Clock::time_point now);

  [[nodiscard]] bool has_messages() const { return !messages_.empty(); }
  [[nodiscard]] std::vector<Message> take_messages() { return std::exchange(messages_, {}); }

  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const Stats& stats() const { return stats_; }
  // Of the last view sent. It grows with each view, over all connections.
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  // What the server ended the session with. Off: it did not.
  [[nodiscard]] const std::optional<protocol::Fault>& fault() const { return fault_; }
  // Both null before the first Opened.
  [[nodiscard]] const Description* description() const { return description_ ? &*description_ : nullptr; }
  [[nodiscard]] const StreamClient* mesh() const { return mesh_ ? &*mesh_ : nullptr; }
  // All of max_bytes is spent: no batch will arrive.
  [[nodiscard]] bool is_exhausted() const { return is_open() && credit_.is_exhausted(); }

  // Nothing if there is no mesh, or if an invalid message may have damaged it.
  [[nodiscard]] std::optional<StreamClient> take_mesh() &&;

 private:
  Result<Event> take(protocol::Opened& opened, Clock::time_point now);
  Result<Event> take(const protocol::Batch& batch, Clock::time_point now);
  Result<Event> take(const protocol::Done& done, Clock::time_point now);
  Result<Event> take(const protocol::Fault& fault, Clock::time_point now);
  Result<void> start_mesh();
  Result<void> accept_answer(std::uint64_t epoch, bool may_follow_done);
  Result<void> apply(const protocol::Batch& batch);
  void send(const protocol::ClientMessage& message);
  void send_haves();
  void send_view(bool gives_up = true);
  void end_motion(Clock::time_point now);
  void send_credit();
  void send_haves(std::span<const SlotGroup> splits, std::optional<std::size_t> channel);
  [[nodiscard]] bool is_open() const { return state_ == State::viewing || state_ == State::idle; }
  [[nodiscard]] tl::unexpected<Error> other_version(std::uint32_t payload) const;
  [[nodiscard]] tl::unexpected<Error> violation(const std::string& what) const;

  Options options_;
  State state_ = State::connecting;
  std::vector<Message> messages_;  // to be sent
  std::optional<Description> description_;
  std::optional<StreamClient> mesh_;
  std::optional<ViewRequest> view_;
  // What the views show that answers may still arrive for: from each of these epochs on.
  struct ShownFrom {
    std::uint64_t epoch = 0;
    RangeRequest shown;
    std::vector<std::string> channels;
  };
  [[nodiscard]] const ShownFrom& shown_in(std::uint64_t epoch) const;
  std::deque<ShownFrom> shown_;
  CreditWindow credit_;
  Stats stats_;
  std::optional<protocol::Fault> fault_;
  Clock::time_point greeted_at_;
  std::uint64_t epoch_ = 0;
  std::uint64_t answered_ = 0;  // epoch of the last batch or Done; at first that of the first view of this session
  std::uint64_t sequence_ = 0;  // of the next batch
  std::uint64_t updates_ = 0;   // that the client has now
  std::uint64_t map_due_ = 0;   // with so many updates a depth map is to be sent
};

}  // namespace intervale
