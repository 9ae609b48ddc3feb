// The header of a MetaImage file, attached (.mha) or detached (.mhd): itk.org/Wiki/ITK/MetaIO/Documentation.
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

[[nodiscard]] bool is_metaimage(std::string_view start);

// Reads and checks a header of at most 64 KiB. The affine is Offset and TransformMatrix, whose first three numbers are
// the direction of the first axis, times ElementSpacing; the world is LPS if the header names an orientation. A fourth
// axis has time points. Fails on other dimensions, on other than 1 or 3 channels, on 64-bit integers, and on data as
// text.
[[nodiscard]] Result<VolumeHeader> read_metaimage_header(const InputFile& file);

}  // namespace intervale
