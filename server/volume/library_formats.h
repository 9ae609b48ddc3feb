// Formats that are read by a library, in a program of its own (child_reader.h): how their files begin.
#pragma once

#include <filesystem>
#include <string_view>

#include "common/util/result.h"
#include "server/volume/child_reader.h"

namespace intervale {

// start: the first bytes of a file, four at least.
[[nodiscard]] inline bool begins_as_tiff(std::string_view start) {
  using namespace std::string_view_literals;
  return start.starts_with("II*\0"sv) || start.starts_with("MM\0*"sv) || start.starts_with("II+\0"sv) || start.starts_with("MM\0+"sv);
}

// start: the first 132 bytes of a file. DICOM files begin with 128 bytes for other formats, and "DICM" (PS3.10, section
// 7.1). Older ones lack both, and begin with the first element of group 2 or 8; of group 8 also in implicit VR, which
// has no letters to know it by: there the value must be one of its element, and more of the group must follow.
[[nodiscard]] bool begins_as_dicom(std::string_view start);

// start: the first 520 bytes of a file; the first 512 may be those of another format, as in MATLAB's files (HDF5 File Format
// Specification, section II.A).
[[nodiscard]] inline bool begins_as_hdf5(std::string_view start) {
  constexpr std::string_view kSignature = "\x89HDF\r\n\x1a\n";
  return start.starts_with(kSignature) || (start.size() >= 520 && start.substr(512).starts_with(kSignature));
}

// The program for a file or a Zarr folder; for another folder, and the folders in it, that which most of the first 100
// files have that have one. nullptr: none. Fails for a folder without any.
[[nodiscard]] Result<const ReaderProgram*> find_reader_program(const std::filesystem::path& path);

}  // namespace intervale
