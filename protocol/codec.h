// Messages to bytes and back. The only place that knows FlatBuffers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/util/result.h"
#include "protocol/messages.h"

namespace intervale::protocol {

// One WebSocket message. What is encoded must be within limits.h.
[[nodiscard]] std::vector<std::uint8_t> encode(const ClientMessage& message);
[[nodiscard]] std::vector<std::uint8_t> encode(const ServerMessage& message);

// Bytes from outside. Structure is verified first, then meaning: strings and arrays within limits.h, levels of detail in order (errors finite
// and not negative, percent 0 to 100, boxes min <= max), a batch's sizes within their bounds. Descriptions are checked further by
// StreamClient::start, payloads by decompress. No allocation beyond the size of the bytes.
[[nodiscard]] Result<ClientMessage> decode_client_message(std::span<const std::uint8_t> bytes);
[[nodiscard]] Result<ServerMessage> decode_server_message(std::span<const std::uint8_t> bytes);

}  // namespace intervale::protocol
