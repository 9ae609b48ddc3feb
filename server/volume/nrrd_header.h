// The header of an NRRD file, attached (.nrrd) or detached (.nhdr): teem.sourceforge.net/nrrd/format.html, versions 1
// to 6.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/util/result.h"
#include "server/volume/input_file.h"

namespace intervale {

struct NrrdHeader {
  enum class Encoding : std::uint8_t { raw, gzip, ascii };

  Grid grid;
  Labels labels;
  SampleType type = SampleType::u8;
  unsigned components = 1;  // numbers a sample: 1, or 3 of a vector
  Encoding encoding = Encoding::raw;
  bool big_endian = false;
  std::uint32_t line_skip = 0;           // lines to skip in the file that holds the data; after them
  std::int64_t byte_skip = 0;            // bytes to skip, of the decoded data; -1 - n: the data ends n bytes before the end
  std::optional<std::string> data_file;  // as written, unchecked; none: the data follows the header
  std::uint64_t data_offset = 0;         // where an attached header ends, in bytes

  [[nodiscard]] std::uint64_t data_bytes() const { return grid.sample_count() * components * size_of(type); }
};

// Reads and checks a header. Fails on anything but three spatial axes of 8 to 32-bit integers or floats, perhaps after an
// axis of the three components of a vector, on directions
// that are singular or not there for every axis, on encodings other than raw, gzip and text, on data in several files,
// and on a header above 1 MiB. Texts that are no labels (labels.h) are ignored. Allocates by the header's own
// length only: its claims have not been compared with the data yet. Any thread; calls are serialised, since teem keeps
// its errors in global variables.
Result<NrrdHeader> read_nrrd_header(const InputFile& file);

}  // namespace intervale
