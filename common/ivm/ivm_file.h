// Interval volumes as files (.ivm). FORMAT.md is the specification.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

inline constexpr std::uint32_t kIvmVersion = 4;

// The file's bytes. Equal volumes give equal bytes; the name is not stored.
[[nodiscard]] std::vector<std::byte> encode_ivm(const IntervalVolume& volume, const ParallelFor& parallel = serial);

// The inverse, for bytes from outside: every checksum is compared, every count bounded by the bytes there are before anything is allocated.
[[nodiscard]] Result<IntervalVolume> decode_ivm(std::span<const std::byte> bytes, std::string name);

// Writes aside and renames.
[[nodiscard]] Result<void> save_ivm(const std::filesystem::path& path, const IntervalVolume& volume, const ParallelFor& parallel = serial);

// The bytes of a file that begins as one of these and is as long as it says, for decode_ivm: nothing is allocated for another. Errors begin with the
// path.
[[nodiscard]] Result<std::vector<std::byte>> read_ivm(const std::filesystem::path& path);

// Both at once; the name is the file's, without folders and extension. Errors begin with the path.
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_ivm(const std::filesystem::path& path);

}  // namespace intervale
