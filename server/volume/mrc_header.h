// The header of an MRC or CCP4 map (.mrc, .map): www.ccpem.ac.uk/mrc_format/mrc2014.php.
#pragma once

#include <string_view>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// At least 1024 bytes.
[[nodiscard]] bool is_mrc(std::string_view start);

// Reads and checks a header. The axes of the world are those of the cell, in angstroms: x along the first, y in the plane
// of the first two. A sample's place is that of ORIGIN if this is not 0, else of the first index. Fails on modes other
// than 0, 1, 2 and 6.
[[nodiscard]] Result<VolumeHeader> read_mrc_header(const InputFile& file);

}  // namespace intervale
