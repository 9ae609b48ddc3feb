// The header of a legacy VTK file with a regular grid (.vtk): "VTK File Formats" in The VTK User's Guide.
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

[[nodiscard]] bool is_legacy_vtk(std::string_view start);

// Reads and checks the lines up to the first array of point data, of which one or three numbers a sample are read: by
// SCALARS, COLOR_SCALARS (in binary files), VECTORS or FIELD. Other arrays may follow; a FIELD before the point data is
// skipped. Fails on datasets other than STRUCTURED_POINTS, on counts that contradict each other, on 64-bit integers, on
// bits, and if these lines take more than 64 KiB.
[[nodiscard]] Result<VolumeHeader> read_vtk_header(const InputFile& file);

}  // namespace intervale
