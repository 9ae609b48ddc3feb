// Compressed data inside a file, from any offset: gzip (RFC 1952), zlib (RFC 1950) or bzip2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// Decodes the data at `offset`, skips `skip` decoded bytes and fills `out`. Returns how many bytes were filled: fewer
// than out.size() if the data ends before. Fails on damaged data. If the data ends within the next few kilobytes, its
// checksum has been compared; concatenated members count as one. encoding: deflate or bzip2.
[[nodiscard]] Result<std::uint64_t> decode(const InputFile& file, Encoding encoding, std::uint64_t offset, std::uint64_t skip,
                                           std::span<std::byte> out);

// The same, but makes `out` as long as `size` or, if that is less, as what there is: as it is decoded.
[[nodiscard]] Result<void> decode_growing(const InputFile& file, Encoding encoding, std::uint64_t offset, std::uint64_t skip, std::uint64_t size,
                                          std::vector<std::byte>& out);

// The decoded size in bytes. Takes the time of a full decoding and the memory of one chunk.
[[nodiscard]] Result<std::uint64_t> decoded_length(const InputFile& file, Encoding encoding, std::uint64_t offset);

}  // namespace intervale
