// NRRD files: reads and writes volumes.
#pragma once

#include <filesystem>

#include "common/util/result.h"
#include "server/volume/volume.h"

namespace intervale {

// Reads an NRRD file with its data attached, or detached in one file in the header's own folder or below it. See
// nrrd_header.h for what fails. The affine is that of `space directions`; without them spacing comes from `spacings` (1
// where there is none). Its origin comes from `space origin` or `axis mins` (0 where there is none). Nothing of the
// volume's size is allocated before the data is long enough to fill it: for raw by its length, for gzip by deflate's greatest ratio (1032), for
// text by two characters a sample. Bytes after the samples are ignored.
Result<Volume> read_nrrd(const std::filesystem::path& path);

// Writes header and samples into one file, raw and little endian: a temporary file that is renamed. read_nrrd returns
// the same grid, bit by bit, and the same labels unless they begin or end with blanks.
Result<void> write_nrrd(const std::filesystem::path& path, const Volume& volume);

}  // namespace intervale
