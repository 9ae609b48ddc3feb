// The header of a NIfTI file: NIfTI-1 (nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h) and NIfTI-2 (nifti2.h), as
// one file (.nii, .nii.gz) or as header and data (.hdr with .img).
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// Whether a file that begins like this, perhaps after it was decompressed, is NIfTI. At least 348 bytes, or 540.
[[nodiscard]] bool is_nifti(std::string_view start);

// Reads and checks a header. The affine is that of sform if there is one, else of qform, else the distances alone; the
// world is RAS. Fails on fewer than three axes, on more than one number a sample, and on colours, complex numbers, 64-bit
// integers and f128.
[[nodiscard]] Result<VolumeHeader> read_nifti_header(const InputFile& file);

}  // namespace intervale
