// The header of an NRRD file, attached (.nrrd) or detached (.nhdr): teem.sourceforge.net/nrrd/format.html, versions 1
// to 6.
#pragma once

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// Reads and checks a header. Fails on anything but three spatial axes of 8 to 32-bit integers or floats, perhaps after an
// axis of the three components of a vector or before one of time points, on directions that are singular or not there
// for every axis, on encodings other than raw, gzip, bzip2 and text, and on a header above 1 MiB. Texts that are no
// labels (labels.h) are ignored. Allocates by the header's own length only: its claims have not been compared with the
// data yet. Any thread; calls are serialised, since teem keeps its errors in global variables.
[[nodiscard]] Result<VolumeHeader> read_nrrd_header(const InputFile& file);

}  // namespace intervale
