// A file that several ranks write at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <vector>

#include "common/util/result.h"
#include "server/cluster/ranks.h"

namespace intervale {

struct SharedPiece {
  std::uint64_t offset = 0;  // in the file
  std::span<const std::byte> bytes;
};

// What rank 0 writes last, when all other pieces lie in the temporary file.
using LastPieces = std::function<Result<std::vector<SharedPiece>>(const std::filesystem::path& temporary)>;

// Writes all pieces of all ranks to a temporary file beside the path, which rank 0 makes, and renames once they are
// there. The folder is one that all ranks see. Fails on all ranks, and leaves nothing behind, if it does on one.
// writes: called with the temporary file as long as there is one, then with an empty path.
[[nodiscard]] Result<void> write_shared_file(Ranks& ranks, const std::filesystem::path& path, std::span<const SharedPiece> pieces,
                                             const LastPieces& last, const std::function<void(const std::filesystem::path&)>& writes);

// The XXH3-64 of some bytes of a file.
[[nodiscard]] Result<std::uint64_t> checksum_of(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t bytes);

}  // namespace intervale
