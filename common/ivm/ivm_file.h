// Interval volumes, data sets of one range, as files (.ivm). FORMAT.md is the specification.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/ivm/interval_volume.h"
#include "common/ivm/ivm_container.h"
#include "common/ivm/kept_pages.h"
#include "common/ivm/page_faults.h"
#include "common/util/parallel.h"
#include "common/util/result.h"

namespace intervale {

// The file's bytes. Equal volumes give equal bytes, whatever `parallel` is; the name is not stored. Weights of scales that
// the box has not are 0. kept: pages of this very volume that were compressed before, and where others go; or null.
[[nodiscard]] std::vector<std::byte> encode_ivm(const IntervalVolume& volume, const ParallelFor& parallel = serial, KeptPages* kept = nullptr);

// The inverse, for bytes from outside: checks every checksum, and every count against what the bytes can hold before it
// allocates; what is decoded grows with what was read. `parallel` may stop it. Throws NoRoom if it would take more memory
// than `room`, besides the bytes. faults: takes damaged pages (page_faults.h), and the volume's relevant() has what is left;
// null: they are an error.
[[nodiscard]] Result<IntervalVolume> decode_ivm(std::span<const std::byte> bytes, std::string name, const ParallelFor& parallel = serial,
                                                std::uint64_t room = kAnyRoom, PageFaults* faults = nullptr);

// Writes a temporary file and renames it.
[[nodiscard]] Result<void> save_ivm(const std::filesystem::path& path, const IntervalVolume& volume, const ParallelFor& parallel = serial,
                                    KeptPages* kept = nullptr);

// Reads a file of one range, then decode_ivm; the name is the file's, without folders and extension. Errors begin with
// the path.
[[nodiscard]] Result<std::shared_ptr<const IntervalVolume>> load_ivm(const std::filesystem::path& path, const ParallelFor& parallel = serial,
                                                                     PageFaults* faults = nullptr);

}  // namespace intervale
