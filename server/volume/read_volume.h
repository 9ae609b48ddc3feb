// Reads volumes in any supported format, and checks their samples.
#pragma once

#include <filesystem>
#include <optional>

#include "common/util/result.h"
#include "server/volume/raw_reader.h"
#include "server/volume/volume.h"

namespace intervale {

// .nrrd and .nhdr files describe themselves: a layout is misuse. Any other file is raw: no layout is misuse.
Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout);

// The samples of one component of a volume, as a volume: component < volume.components.
[[nodiscard]] Volume component_of(const Volume& volume, unsigned component);

// Fails if a sample is NaN or infinite, and gives the (i, j, k) of the first one; a replacement, if given, is stored in
// all of them instead. A replacement that is not finite in the volume's type is misuse.
Result<void> check_finite(Volume& volume, std::optional<double> replacement);

}  // namespace intervale
