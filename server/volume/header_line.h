// The header of a volume as a line of JSON: what a reader program (child_reader.h) writes before the samples.
#pragma once

#include <string>
#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

inline constexpr std::size_t kMaxHeaderLine = 1 << 20;  // bytes

// Without a line break. Only what does not say how a file stores its samples.
[[nodiscard]] std::string header_line(const VolumeHeader& header);

// The inverse, of a line that may say anything: names, labels and numbers are checked as those of files are. The message
// begins with `where`.
[[nodiscard]] Result<VolumeHeader> parse_header_line(std::string_view line, const std::string& where);

}  // namespace intervale
