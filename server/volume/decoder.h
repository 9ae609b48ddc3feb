// Coded data inside a file: gzip (RFC 1952), zlib (RFC 1950) or bzip2, or any of it as base64 text (RFC 4648).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

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

// Decodes the data, skips `skip` decoded bytes and fills `out`. Returns how many bytes were filled: fewer than out.size()
// if the data ends before. Fails on damaged data. If the data ends within the next few kilobytes, its checksum has been
// compared; concatenated members count as one.
[[nodiscard]] Result<std::uint64_t> decode(const Coded& data, std::uint64_t skip, std::span<std::byte> out);

// The same, but makes `out` as long as `size` or, if that is less, as what there is: as it is decoded.
[[nodiscard]] Result<void> decode_growing(const Coded& data, std::uint64_t skip, std::uint64_t size, std::vector<std::byte>& out);

// The decoded size in bytes. Takes the time of a full decoding and the memory of one chunk.
[[nodiscard]] Result<std::uint64_t> decoded_length(const Coded& data);

}  // namespace intervale
