// Encodes and decodes messages. The only user of FlatBuffers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/util/result.h"
#include "protocol/messages.h"

namespace intervale::protocol {

// The bytes of one WebSocket message. The message must be within limits.h.
[[nodiscard]] std::vector<std::uint8_t> encode(const ClientMessage& message);
[[nodiscard]] std::vector<std::uint8_t> encode(const ServerMessage& message);

// Whether a data set's description is within limits.h: its table of values may be too large. Otherwise an error in one
// line that says what to do.
[[nodiscard]] Result<void> check_sendable(const Description& description);

// Untrusted bytes. The FlatBuffers verifier checks the structure; then the values are checked: strings and arrays
// against limits.h, levels of detail (errors finite and not negative, percentages in [0, 100], boxes with min <=
// max), the sizes of a batch. A description has as many corners and
// weights as its grid needs. Not checked here: descriptions beyond that (see StreamClient::start), versions of payloads
// and payloads (see apply_batch). Allocates no more than the size of the bytes, and 24 bytes for each of at most
// kMaxTableValues values of a table.
[[nodiscard]] Result<ClientMessage> decode_client_message(std::span<const std::uint8_t> bytes);
[[nodiscard]] Result<ServerMessage> decode_server_message(std::span<const std::uint8_t> bytes);

}  // namespace intervale::protocol
