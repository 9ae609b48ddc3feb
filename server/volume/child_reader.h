// Formats that are read by libraries. Each library works in a program of its own (server/readers), which may crash or
// hang on a hostile file without harm to this one, and which is loaded for such files only.
//
//   read-FORMAT PATH [--part NAME] [--time-point N] [--header]
//
// writes a line of JSON (header_line.h) to its standard output and then the samples of one time point: z by z, y by y, in
// the machine's byte order; or one line to its standard error, and exits with 1 or, after wrong usage, 2.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/util/result.h"
#include "server/volume/volume_reader.h"

namespace intervale {

struct ReaderProgram {
  const char* name;    // of the program
  const char* format;  // that it reads
};

// What is in a file or a folder. part: which of several volumes (VolumeHeader::parts); without it the first.
[[nodiscard]] Result<VolumeHeader> read_header_by(const ReaderProgram& program, const std::filesystem::path& path,
                                                  const std::optional<std::string>& part);

// Its samples. To choose no part or time point where there are several is misuse. Reading fails if no sample arrives for a
// minute.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_by(const ReaderProgram& program, const std::filesystem::path& path,
                                                            const std::optional<std::string>& part, std::optional<std::uint64_t> time_point);

}  // namespace intervale
