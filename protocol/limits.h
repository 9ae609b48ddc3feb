// Every maximum of the protocol, and why it is what it is. Sizes in bytes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace intervale::protocol {

// A client's largest messages are a Have, or a View that forgets: room for kMaxHave supercubes.
inline constexpr std::size_t kMaxClientMessage = 64 << 10;

// Supercubes in one Have, or to be forgotten in one View: 25 bytes each at most, uncompressed.
inline constexpr std::size_t kMaxHave = 2048;

// Largest payload of a Batch. A batch is cut by what it would take if nothing could be compressed; it takes about half of that, and 64 KiB keep a
// batch's time on a slow line short (50 ms at 10 Mbit/s), so that a new view soon gets its turn.
inline constexpr std::size_t kMaxBatchPayload = 128 << 10;

// What a Batch message holds besides its payload, at most (the codec's tests hold it to that), and what a Batch costs in credit besides it.
inline constexpr std::size_t kBatchEnvelope = 160;

// Largest message to a client: a Batch; an Opened is well below.
inline constexpr std::size_t kMaxServerMessage = kMaxBatchPayload + kBatchEnvelope;

// Smallest payload that a server cuts: a batch is still worth its envelope, and a client's byte budget is used up to about this.
inline constexpr std::size_t kMinPayload = 1 << 10;

// With this much credit a batch of kMinPayload fits for certain, incompressible or not: below it the server may wait, at it, it may not.
inline constexpr std::uint64_t kMinCredit = kMinPayload + 256;

// A client's usual window: a few batches, so that the line never runs dry at 20 ms round trip and 100 Mbit/s.
inline constexpr std::uint64_t kDefaultWindow = 256 << 10;

// Most credit outstanding: bounds what a session can have in flight; enough for 1 Gbit/s at 100 ms.
inline constexpr std::uint64_t kMaxWindow = 16 << 20;

// A file name's length, since a data set is named after its file.
inline constexpr std::size_t kMaxName = 255;

// Free text: a client's name, a fault's reason.
inline constexpr std::size_t kMaxText = 200;

// The base's bytes: 8 corners' sides and up to two cuts on each of 19 edges take far fewer.
inline constexpr std::size_t kMaxBase = 1024;

// What the FlatBuffers verifier lets pass: the deepest message of ours nests 3 tables and has 3 in all.
inline constexpr std::uint32_t kMaxDepth = 8;
inline constexpr std::uint32_t kMaxTables = 16;

inline constexpr std::chrono::seconds kHandshakeTime{10};  // from the WebSocket's start to Open, and for closing
inline constexpr std::chrono::seconds kStallTime{120};     // how long updates wait for credit
inline constexpr std::chrono::seconds kWriteTime{60};      // how long one message may take to leave the server
inline constexpr std::chrono::seconds kIdleTime{60};       // silence, pings unanswered

}  // namespace intervale::protocol
