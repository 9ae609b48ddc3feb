// Byte planes: bytes of one meaning side by side, each plane compressed by itself, so that each has a code table of its
// own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace intervale {

// Appends a plane to out: its length, the length it is stored in (both variable-length), and its bytes, compressed
// (zstd) unless that gains nothing.
void append_plane(std::vector<std::uint8_t>& out, std::span<const std::uint8_t> plane, int compression);

// Takes one plane off the front of bytes from outside. Nothing if they do not begin with a plane of at most `most`
// bytes. Allocates no more than it returns.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> take_plane(std::span<const std::uint8_t>& bytes, std::size_t most);

// Variable-length integers: seven bits a byte, lowest first, the top bit set on all but the last.
void append_varint(std::vector<std::uint8_t>& out, std::uint64_t value);
[[nodiscard]] std::optional<std::uint64_t> take_varint(std::span<const std::uint8_t>& bytes);

// Converts words of `width` bytes to planes: all lowest bytes, then all second ones, and so on; and back.
[[nodiscard]] std::vector<std::uint8_t> split_bytes(std::span<const std::uint64_t> words, unsigned width);
// bytes.size(): a multiple of width
[[nodiscard]] std::vector<std::uint64_t> join_bytes(std::span<const std::uint8_t> bytes, unsigned width);

}  // namespace intervale
