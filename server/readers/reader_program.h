// What the programs have in common that read formats by the formats' own libraries: see child_reader.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

struct ReaderRequest {
  std::filesystem::path path;
  std::optional<std::string> part;  // which of several volumes; none: the first
  std::uint64_t time_point = 0;
  bool only_header = false;
};

// The standard output: the header, and then slices of z. All fail once nobody reads it any more.
[[nodiscard]] Result<void> write_header(const VolumeHeader& header);
[[nodiscard]] Result<void> write_samples(std::span<const std::byte> samples);

// The program's main function: exits with the status.
[[noreturn]] void run_reader(int argc, char** argv, Result<void> (*read)(const ReaderRequest& request));

// To be called before a library that allocates what a file claims reads it: for a file of so many bytes it gets 64 times that
// and 512 MiB, beyond what the program has.
void limit_memory_for(std::uint64_t file_bytes);

// The files in a folder and the folders in it, numbers in their names by value: slice_9 comes before slice_10. Not those
// whose names begin with a dot. Of a file, itself. Fails above 2^20 files.
[[nodiscard]] Result<std::vector<std::filesystem::path>> files_of(const std::filesystem::path& path);

}  // namespace intervale
