// Coded data inside a file: gzip (RFC 1952), zlib (RFC 1950) or bzip2, or any of it as base64 text (RFC 4648).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// Where coded data begins, and how it is coded; see VolumeHeader.
struct Coded {
  const InputFile& file;
  Encoding encoding = Encoding::deflate;  // raw, deflate or bzip2
  std::uint64_t offset = 0;               // bytes
  std::optional<std::uint64_t> base64_skip{};
  std::uint64_t coded_bytes = UINT64_MAX;
};

// Decodes data from its beginning on. Concatenated members count as one. Fails on damaged data.
class Decoder {
 public:
  explicit Decoder(const Coded& data);  // its file must outlive this
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) = delete;
  ~Decoder();

  // Fills `out`. Returns how many bytes were filled: fewer than out.size() only at the end of the data.
  [[nodiscard]] Result<std::uint64_t> read(std::span<std::byte> out);
  // Passes over so many bytes. Returns how many there were.
  [[nodiscard]] Result<std::uint64_t> skip(std::uint64_t bytes);
  // If the data ends within the next few kilobytes, compares its checksum.
  [[nodiscard]] Result<void> look_for_end();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// Skips `skip` decoded bytes and fills `out`, as Decoder::read() does; looks for the end after that.
[[nodiscard]] Result<std::uint64_t> decode(const Coded& data, std::uint64_t skip, std::span<std::byte> out);

// The decoded size in bytes. Takes the time of a full decoding and the memory of one chunk.
[[nodiscard]] Result<std::uint64_t> decoded_length(const Coded& data);

}  // namespace intervale
