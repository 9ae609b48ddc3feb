// NRRD files: reads and writes volumes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <utility>

#include "common/patch/volume.h"
#include "common/util/atomic_file.h"
#include "common/util/result.h"

namespace intervale {

// Reads an NRRD file of one time point: see nrrd_header.h and volume_reader.h. The affine is that of `space
// directions`; without them spacing comes from `spacings` (1 where there is none). Its origin comes from `space origin`
// or `axis mins` (0 where there is none).
Result<Volume> read_nrrd(const std::filesystem::path& path);

// Writes header and samples into one file, raw and little endian: a temporary file that is renamed. read_nrrd returns
// the same grid, bit by bit, and the same labels unless they begin or end with blanks, or the space is another one than
// RAS, LAS or LPS.
Result<void> write_nrrd(const std::filesystem::path& path, const Volume& volume);

// The same file, written as its samples are made. Without commit(), nothing is left of it.
class NrrdWriter {
 public:
  // Writes the header. volume: its samples are not looked at.
  static Result<NrrdWriter> create(const std::filesystem::path& path, const Volume& volume);
  Result<void> write(std::span<const std::byte> samples) { return file_.write(samples); }  // the next ones
  Result<void> commit() { return file_.commit(); }                                         // all have been written

 private:
  explicit NrrdWriter(AtomicFile file) : file_(std::move(file)) {}
  AtomicFile file_;
};

}  // namespace intervale
