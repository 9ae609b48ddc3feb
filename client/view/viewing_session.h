// The session of an interactive viewer, without I/O: a ClientSession whose view is a camera, or a region to refine.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/core/client_session.h"
#include "common/util/result.h"
#include "common/view/lod.h"

namespace intervale {

// What is to be seen.
struct WantedView {
  Camera camera;                           // pixel_error: how far surfaces may be off, if there is no region
  std::optional<Box> region;               // refined to error 0; the rest only as far as conformity requires, whatever is here
  Budget budget;                           // max_updates: at least kMinRoom
  RangeRequest shown;                      // of the data set
  std::vector<std::string> channels = {};  // likewise
  bool is_opaque = false;                  // surfaces hide what is behind them, and nothing is cut away
  friend bool operator==(const WantedView&, const WantedView&) = default;
};

// Driven like a ClientSession.
class ViewingSession {
 public:
  using Clock = ClientSession::Clock;
  static constexpr std::uint64_t kMinRoom = 1000;  // updates

  // client: name and version, for the server's log.
  ViewingSession(std::string dataset, std::string client) : session_({.dataset = std::move(dataset), .client = std::move(client)}) {}

  // What is wanted from now on. Fails, and changes nothing, if check_lod refuses the camera or the region, or the data
  // set has not all that is to be shown. depth: of this camera, and an opaque view's, if there is a surface already.
  // now: what is soon in the picture of a camera that moves comes a little earlier.
  Result<void> look(const WantedView& view, std::optional<DepthMap> depth = {}, Clock::time_point now = Clock::now());

  // See ClientSession.
  [[nodiscard]] bool wants_depth_map() const { return session_.wants_depth_map(); }
  void send_depth_map(DepthMap map) { session_.send_depth_map(std::move(map)); }
  [[nodiscard]] const std::optional<WantedView>& view() const { return view_; }

  // What is shown until the next look(): see ClientSession::preview().
  Result<void> preview(const RangeRequest& shown) { return session_.preview(shown); }

  void connected(Clock::time_point now) { session_.connected(now); }  // after the first look()
  void disconnected() { session_.disconnected(); }
  Result<ClientSession::Event> receive(std::span<const std::uint8_t> message, Clock::time_point now);
  [[nodiscard]] std::vector<ClientSession::Message> take_messages() { return session_.take_messages(); }

  [[nodiscard]] const ClientSession& session() const { return session_; }
  [[nodiscard]] const StreamClient* mesh() const { return session_.mesh(); }
  // Everything that the view wants, and that there is room for, has arrived.
  [[nodiscard]] bool is_done() const { return session_.state() == ClientSession::State::idle; }
  // An upper bound on the error on the camera's screen. When the view is done: the error that it asked for, or 0 if
  // nothing is left to refine. 0 for a region.
  [[nodiscard]] double remaining_pixels() const;

 private:
  ClientSession session_;
  std::optional<WantedView> view_;
  CameraMotion motion_;
  bool gave_up_more_ = false;  // for this view, because there was no room
};

}  // namespace intervale
