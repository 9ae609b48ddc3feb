// gzip data inside a file (RFC 1952), from any offset.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/util/result.h"
#include "server/volume/input_file.h"

namespace intervale {

// Decodes the data at `offset`, skips `skip` decoded bytes and fills `out`. Returns how many bytes were filled: fewer
// than out.size() if the data ends before. Fails on damaged data. If the data ends within the next few kilobytes, its
// checksum has been compared; concatenated members count as one.
Result<std::uint64_t> gzip_decode(const InputFile& file, std::uint64_t offset, std::uint64_t skip, std::span<std::byte> out);

// The decoded size in bytes. Takes the time of a full decoding and the memory of one chunk.
Result<std::uint64_t> gzip_length(const InputFile& file, std::uint64_t offset);

}  // namespace intervale
