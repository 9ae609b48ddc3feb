// The limits of the protocol, with their reasons. Sizes in bytes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace intervale::protocol {

// Largest message from a client: a Have, or a View that forgets, with kMaxHave supercubes.
inline constexpr std::size_t kMaxClientMessage = 64 << 10;

// Most supercubes in one Have, or forgotten in one View: at most 25 bytes each, uncompressed.
inline constexpr std::size_t kMaxHave = 2048;

// Largest payload of a Batch, before compression, which about halves it. 64 KiB take 50 ms at 10 Mbit/s: short enough
// that a new view soon gets its first batch.
inline constexpr std::size_t kMaxBatchPayload = 128 << 10;

// Most bytes of a Batch message besides its payload (checked by the codec's tests), and what it costs in credit
// besides it.
inline constexpr std::size_t kBatchEnvelope = 160;

// Largest table of values in a Description: as it is coded, and the number of its values. An Opened has room for it.
inline constexpr std::size_t kMaxTableBytes = 96 << 10;
inline constexpr std::size_t kMaxTableValues = 128 << 10;

// Largest message from the server: a Batch. An Opened is smaller.
inline constexpr std::size_t kMaxServerMessage = kMaxBatchPayload + kBatchEnvelope;

// Smallest bound on a payload: large against the envelope, and small enough that a client can use up its byte budget.
inline constexpr std::size_t kMinPayload = 1 << 10;

// Credit with which a batch of kMinPayload certainly fits. Below it the server may wait for credit; otherwise it must
// send.
inline constexpr std::uint64_t kMinCredit = kMinPayload + 256;

// A client's default window: a few batches, enough for 100 Mbit/s at a round trip of 20 ms.
inline constexpr std::uint64_t kDefaultWindow = 256 << 10;

// Most credit outstanding, which bounds the bytes in flight: enough for 1 Gbit/s at a round trip of 100 ms.
inline constexpr std::uint64_t kMaxWindow = 16 << 20;

// Longest name of a data set: that of a file name, since data sets are named after their files.
inline constexpr std::size_t kMaxName = 255;

// Longest free text: the client's name, the text of a Fault.
inline constexpr std::size_t kMaxText = 200;

// Limits of the FlatBuffers verifier. The deepest message nests 5 tables; one with all channels has 67.
inline constexpr std::uint32_t kMaxDepth = 8;
inline constexpr std::uint32_t kMaxTables = 80;

inline constexpr std::chrono::seconds kHandshakeTime{10};  // from the upgrade to Open, and for the closing handshake
inline constexpr std::chrono::seconds kStallTime{120};     // without credit while there are updates to send
inline constexpr std::chrono::seconds kWriteTime{60};      // for sending one message
inline constexpr std::chrono::seconds kIdleTime{60};       // without any frame or pong

}  // namespace intervale::protocol
