// NRRD files: reads and writes volumes.
#pragma once

#include <filesystem>

#include "common/patch/volume.h"
#include "common/util/result.h"

namespace intervale {

// Reads an NRRD file of one time point: see nrrd_header.h and volume_reader.h. The affine is that of `space
// directions`; without them spacing comes from `spacings` (1 where there is none). Its origin comes from `space origin`
// or `axis mins` (0 where there is none).
Result<Volume> read_nrrd(const std::filesystem::path& path);

// Writes header and samples into one file, raw and little endian: a temporary file that is renamed. read_nrrd returns
// the same grid, bit by bit, and the same labels unless they begin or end with blanks, or the space is another one than RAS, LAS or LPS.
Result<void> write_nrrd(const std::filesystem::path& path, const Volume& volume);

}  // namespace intervale
