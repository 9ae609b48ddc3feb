// Writes volumes as NRRD files.
#pragma once

#include <filesystem>

#include "common/util/result.h"
#include "server/volume/volume.h"

namespace intervale {

// Writes header and samples into one file, raw and little endian: a temporary file that is renamed. read_nrrd returns
// the same grid, bit by bit.
Result<void> write_nrrd(const std::filesystem::path& path, const Volume& volume);

}  // namespace intervale
