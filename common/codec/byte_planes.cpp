#include "common/codec/byte_planes.h"

#include <zstd.h>

#include <memory>
#include <new>

namespace intervale {

namespace {
constexpr std::uint64_t kMostPerByte = 1 << 15;  // a block of 128 KiB that repeats one byte takes 4 bytes (RFC 8878, 3.1.1.2)

#ifndef INTERVALE_STORED_PLANES
// To make one takes as long as to compress a small plane.
ZSTD_CCtx& compressor_of_thread() {
  struct Free {
    void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  };
  thread_local const std::unique_ptr<ZSTD_CCtx, Free> kContext(ZSTD_createCCtx());
  if (!kContext) throw std::bad_alloc();
  return *kContext;
}
#endif
}  // namespace

void append_plane(std::vector<std::uint8_t>& out, std::span<const std::uint8_t> plane, int compression) {
  append_varint(out, plane.size());
  if (plane.empty()) return;
// The browser's modules have no compressor: one of them sends tables of values, to the other
#ifdef INTERVALE_STORED_PLANES
  (void)compression;
  append_varint(out, plane.size());
  out.insert(out.end(), plane.begin(), plane.end());
#else
  std::vector<std::uint8_t> stored(ZSTD_compressBound(plane.size()));
  const std::size_t n = ZSTD_compressCCtx(&compressor_of_thread(), stored.data(), stored.size(), plane.data(), plane.size(), compression);
  if (ZSTD_isError(n) || n >= plane.size()) {
    append_varint(out, plane.size());
    out.insert(out.end(), plane.begin(), plane.end());
    return;
  }
  append_varint(out, n);
  out.insert(out.end(), stored.begin(), stored.begin() + std::ptrdiff_t(n));
#endif
}

std::optional<std::vector<std::uint8_t>> take_plane(std::span<const std::uint8_t>& bytes, std::size_t most) {
  const auto size = take_varint(bytes);
  if (!size || *size > most) return {};
  if (*size == 0) return std::vector<std::uint8_t>();
  const auto stored = take_varint(bytes);
  if (!stored || *stored > bytes.size() || *stored > *size || *size / kMostPerByte > *stored) return {};
  const auto from = bytes.first(*stored);
  bytes = bytes.subspan(*stored);
  if (*stored == *size) return std::vector<std::uint8_t>(from.begin(), from.end());
  // The frame must declare the same size before memory is allocated for it.
  if (ZSTD_getFrameContentSize(from.data(), from.size()) != *size) return {};
  std::vector<std::uint8_t> plane(*size);
  if (ZSTD_decompress(plane.data(), plane.size(), from.data(), from.size()) != *size) return {};
  return plane;
}

void append_varint(std::vector<std::uint8_t>& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) out.push_back(std::uint8_t(value | 0x80));
  out.push_back(std::uint8_t(value));
}

std::optional<std::uint64_t> take_varint(std::span<const std::uint8_t>& bytes) {
  std::uint64_t value = 0;
  for (int shift = 0; shift < 63 && !bytes.empty(); shift += 7) {
    const std::uint8_t b = bytes[0];
    bytes = bytes.subspan(1);
    value |= std::uint64_t(b & 0x7f) << shift;
    if (b < 0x80) return value;
  }
  return {};
}

std::vector<std::uint8_t> split_bytes(std::span<const std::uint64_t> words, unsigned width) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(words.size() * width);
  for (unsigned b = 0; b < width; ++b) {
    for (std::uint64_t w : words) bytes.push_back(std::uint8_t(w >> (8 * b)));
  }
  return bytes;
}

std::vector<std::uint64_t> join_bytes(std::span<const std::uint8_t> bytes, unsigned width) {
  std::vector<std::uint64_t> words(bytes.size() / width);
  for (unsigned b = 0; b < width; ++b) {
    for (std::size_t i = 0; i < words.size(); ++i) words[i] |= std::uint64_t(bytes[b * words.size() + i]) << (8 * b);
  }
  return words;
}

}  // namespace intervale
