// The header of a VTK file with a regular grid as XML (.vti): docs.vtk.org, "VTK XML Formats", ImageData.
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

[[nodiscard]] bool is_vti(std::string_view start);

// Reads and checks the XML before the first data, at most 1 MiB of it. Of the point data the active scalars are read,
// without any the first array; of one or three components, inline or appended, as text, base64 or raw, plain or
// compressed by zlib. Fails on several pieces or time steps, on counts that contradict each other, on 64-bit integers, and on
// other compressors.
[[nodiscard]] Result<VolumeHeader> read_vti_header(const InputFile& file);

}  // namespace intervale
