// The messages of intervale.v1 as plain structs. PROTOCOL.md says who may send which message when.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "common/view/depth_map.h"
#include "common/view/lod.h"
#include "protocol/limits.h"

namespace intervale::protocol {

inline constexpr const char* kSubprotocol = "intervale.v1";  // the WebSocket subprotocol
// A client that cannot set headers offers its token as a second subprotocol: this prefix, then the token in base64url
// without padding.
inline constexpr const char* kTokenSubprotocol = "intervale.token.";
inline constexpr const char* kPath = "/v1/stream";       // the path of the WebSocket
inline constexpr const char* kServerName = "intervale";  // how the HTTP field Server begins

// The version of the layout of batches' payloads. 1: updates are sides and cuts; peers that do not say their version
// have it. 2: updates are values. 3: the same; descriptions have an affine instead of spacing and origin. 4: names
// are range coded.
inline constexpr std::uint32_t kPayloadVersion = 4;

// Why a session ended: WebSocket close codes.
enum class CloseCode : std::uint16_t {
  normal = 1000,
  going_away = 1001,    // the server shuts down, or has no capacity
  text_frame = 1003,    // a text frame: only binary frames are allowed
  internal = 1011,      // an internal error of the server
  malformed = 4400,     // a message that cannot be decoded, or has invalid values
  unauthorized = 4401,  // no valid token
  forbidden = 4403,     // the token does not grant this data set
  no_such_dataset = 4404,
  timed_out = 4408,      // no Open, or no credit, in time
  out_of_order = 4409,   // a message that is not allowed in this state
  too_large = 4413,      // a message or the credit exceeds its limit
  no_such_range = 4416,  // the data set has not what the view is to show: a range, or a channel
  other_version = 4426   // the client reads batches of another version than the server sends
};

// Client to server.
struct Open {
  std::string dataset;
  std::string client;        // its name and version, for the server's log
  std::uint64_t credit = 0;  // first grant; see Credit
  // Content_hash of the data set whose updates the client holds and will list in Have.
  std::optional<std::uint64_t> resume = {};
  std::uint32_t payload = kPayloadVersion;  // the version of batches that the client reads; 0: it does not say
  friend bool operator==(const Open&, const Open&) = default;
};
// The updates that a resuming client holds. Between Open and the first View, in as many messages as needed.
struct Have {
  std::vector<SlotGroup> splits;  // at most kMaxHave; keys ascending; only keys and slots are sent
  // Not the updates, but the values of this channel of the data set at them; after the Have of those updates.
  std::optional<std::size_t> channel = {};
  friend bool operator==(const Have&, const Have&) = default;
};
// What the client wants from now on.
struct View {
  std::uint64_t epoch = 0;  // names this view in the answers to it; greater than that of the previous View
  Lod lod;
  std::optional<std::uint64_t> room = {};  // most updates that the client holds; the server sends no more than that
  // Updates that the client forgets: at most kMaxHave; keys ascending; only keys and slots are sent. Both sides apply
  // the rule of Front::forget().
  std::vector<SlotGroup> forget = {};
  // What is shown of the data set, at most kMaxRanges ranges; both sides code the answers for it (common/codec/batch.h).
  RangeRequest shown = {};
  // The server may begin before it is known how far the surfaces of the ranges move. The mesh may get finer than the
  // view asks for.
  bool early = false;
  // Updates of every range, too, whose error is greater than this: 0 to 100 percent of the data set's max_error. They follow
  // Done; the coarsest may come before. Only from a data set of every range.
  std::optional<double> coarse_error_percent = {};
  std::vector<std::string> channels = {};  // whose values are sent with the updates: names of the data set's
  // What the lod's camera sees of the client's mesh: updates that lie behind are sent last.
  std::optional<DepthMap> depth = {};
  // Where the lod's camera will be soon.
  std::optional<Camera> ahead = {};
  friend bool operator==(const View&, const View&) = default;
};
struct Credit {
  std::uint64_t bytes = 0;  // additional bytes of Batch messages that the server may send; see cost_of
  friend bool operator==(const Credit&, const Credit&) = default;
};
using ClientMessage = std::variant<Open, View, Credit, Have>;

// Server to client.
struct SessionLimits {
  std::uint64_t max_window = kMaxWindow;  // most credit outstanding
  std::uint64_t min_credit = kMinCredit;  // with at least this credit the server sends, if there is anything to send
  std::uint64_t max_message = kMaxClientMessage;
  friend bool operator==(const SessionLimits&, const SessionLimits&) = default;
};
struct Opened {
  Description description;
  SessionLimits limits;
  bool resumed = false;  // the server does not send the updates in Have again; false: the client must discard them
  // The version of batches that the server sends; 0: it does not say. If it is not kPayloadVersion, the description's
  // format, is_exact, corners and weights mean nothing.
  std::uint32_t payload = kPayloadVersion;
  friend bool operator==(const Opened&, const Opened&) = default;
};
struct Batch {
  std::uint64_t epoch = 0;     // of the View it serves
  std::uint64_t sequence = 0;  // 0, 1, 2, … within a session
  std::uint32_t updates = 0;
  // Upper bounds over the updates that the view wants and that are not yet sent; 0 in the last batch.
  double remaining_error = 0;   // the largest saturated error; field units
  double remaining_pixels = 0;  // the largest error on the screen; 0 without a camera
  std::uint64_t updates_to_go = 0;
  std::vector<std::uint8_t> payload;  // updates; see common/codec/batch.h; empty if there are none
  // The values of the view's channels at those updates, or else at some that the client has; see
  // common/codec/channel_batch.h. Empty if there are none.
  std::vector<std::uint8_t> channels = {};
  friend bool operator==(const Batch&, const Batch&) = default;
};
// The credit that a Batch uses, counted alike by client and server: at least the bytes of its message.
[[nodiscard]] inline std::uint64_t cost_of(const Batch& batch) { return batch.payload.size() + batch.channels.size() + kBatchEnvelope; }

struct Done {
  std::uint64_t epoch = 0;
  std::uint64_t updates_sent = 0;  // updates that the client holds
  bool full = false;               // the view wants more, but the client holds as many as it may (View::room)
  friend bool operator==(const Done&, const Done&) = default;
};
struct Fault {
  CloseCode code = CloseCode::internal;  // the close code that follows
  std::string text;                      // one line for users
  friend bool operator==(const Fault&, const Fault&) = default;
};
using ServerMessage = std::variant<Opened, Batch, Done, Fault>;

}  // namespace intervale::protocol
