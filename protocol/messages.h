// The messages of intervale.v1 as plain structs. Who may send what when: PROTOCOL.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/diamond/supercube.h"
#include "common/patch/description.h"
#include "common/view/lod.h"
#include "protocol/limits.h"

namespace intervale::protocol {

inline constexpr const char* kSubprotocol = "intervale.v1";  // the WebSocket subprotocol: client offers it, server confirms it
// A client that cannot set headers offers its token beside it, as a subprotocol of this and the token in base64url without padding.
inline constexpr const char* kTokenSubprotocol = "intervale.token.";
inline constexpr const char* kPath = "/v1/stream";       // the WebSocket's path
inline constexpr const char* kServerName = "intervale";  // how the server's HTTP Server header begins

// Why a session ended, as the WebSocket's close code.
enum class CloseCode : std::uint16_t {
  normal = 1000,
  going_away = 1001,    // the server shuts down
  text_frame = 1003,    // a text frame, where only binary ones are spoken
  internal = 1011,      // the server's own failure
  malformed = 4400,     // a message that does not decode, or says what cannot be
  unauthorized = 4401,  // no token, or one that opens nothing
  forbidden = 4403,     // the token does not open this data set
  no_such_dataset = 4404,
  timed_out = 4408,     // no Open within the handshake time, or no credit while updates wait
  out_of_order = 4409,  // a message that is not allowed in this state
  too_large = 4413,     // a message, or a credit, over its limit
};

// Client to server.
struct Open {
  std::string dataset;
  std::string client;                        // name and version, for the server's log
  std::uint64_t credit = 0;                  // first grant; see Credit
  std::optional<std::uint64_t> resume = {};  // the content_hash of what the client holds updates of, and will name in Have
  friend bool operator==(const Open&, const Open&) = default;
};
// What a client that resumes has split already: between Open and the first View, as many Haves as it takes.
struct Have {
  std::vector<SlotGroup> splits;  // at most kMaxHave; keys ascending; only keys and slots are sent
  friend bool operator==(const Have&, const Have&) = default;
};
struct View {
  std::uint64_t epoch = 0;  // greater than that of the View before
  Lod lod;
  std::optional<std::uint64_t> room = {};  // the most updates that the client keeps: no more are sent than make so many
  // What it gives up for this view: at most kMaxHave; keys ascending; only keys and slots are sent. See Front::forget, which both sides do.
  std::vector<SlotGroup> forget = {};
  friend bool operator==(const View&, const View&) = default;
};
struct Credit {
  std::uint64_t bytes = 0;  // so much more of Batch messages may come; see cost_of
  friend bool operator==(const Credit&, const Credit&) = default;
};
using ClientMessage = std::variant<Open, View, Credit, Have>;

// Server to client.
struct SessionLimits {
  std::uint64_t max_window = kMaxWindow;  // most credit that may be outstanding
  std::uint64_t min_credit = kMinCredit;  // with at least this much outstanding the server sends if anything is wanted
  std::uint64_t max_message = kMaxClientMessage;
  friend bool operator==(const SessionLimits&, const SessionLimits&) = default;
};
struct Opened {
  Description description;
  SessionLimits limits;
  bool resumed = false;  // the data is what the client holds updates of: what it has is not sent again. Else it starts afresh.
  friend bool operator==(const Opened&, const Opened&) = default;
};
struct Batch {
  std::uint64_t epoch = 0;     // of the View it serves
  std::uint64_t sequence = 0;  // 0, 1, 2, … within a session
  std::uint32_t updates = 0;
  // Of what the view wants and was not yet sent when this batch was made; bounds from above, 0 with the last batch.
  double remaining_error = 0;   // the largest saturated error; field units
  double remaining_pixels = 0;  // the largest error on the camera's screen; 0 without a camera
  std::uint64_t updates_to_go = 0;
  std::vector<std::uint8_t> payload;  // updates; see common/codec/batch.h
  friend bool operator==(const Batch&, const Batch&) = default;
};
// The credit that a Batch takes: client and server count alike, and never less than the message's bytes.
[[nodiscard]] inline std::uint64_t cost_of(const Batch& batch) { return batch.payload.size() + kBatchEnvelope; }

struct Done {
  std::uint64_t epoch = 0;
  std::uint64_t updates_sent = 0;  // that the client has
  bool full = false;               // there was no room for more, which may be wanted
  friend bool operator==(const Done&, const Done&) = default;
};
struct Fault {
  CloseCode code = CloseCode::internal;  // the close code that follows
  std::string text;                      // one line for people
  friend bool operator==(const Fault&, const Fault&) = default;
};
using ServerMessage = std::variant<Opened, Batch, Done, Fault>;

}  // namespace intervale::protocol
