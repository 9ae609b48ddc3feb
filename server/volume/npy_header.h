// The header of a NumPy array file (.npy): numpy.org/doc/stable/reference/generated/numpy.lib.format.html, versions 1 to
// 3.
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

[[nodiscard]] bool is_npy(std::string_view start);

// Reads and checks a header. The axis whose samples lie side by side is x: of an array in C order the last one, of one
// in Fortran order the first. A fourth axis has time points, at the other end; but in C order a last axis of 3 has the
// components of a vector. Samples are 1 apart. Fails on other shapes, and on 64-bit integers, 16-bit floats, complex
// numbers and objects.
[[nodiscard]] Result<VolumeHeader> read_npy_header(const InputFile& file);

}  // namespace intervale
