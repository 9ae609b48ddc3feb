// Any volume a user may name, made ready for building.
#pragma once

#include <filesystem>
#include <optional>

#include "common/util/result.h"
#include "server/volume/raw_reader.h"
#include "server/volume/volume.h"

namespace intervale {

// .nrrd and .nhdr files describe themselves, and a layout given for one is misuse; anything else is raw and needs a layout, or it is misuse.
Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout);

// Refuses a volume of floats with a NaN or infinite sample, naming the first one by (i, j, k); with a replacement every such sample becomes
// that instead. A replacement that is not finite in the volume's type is misuse. Integers always pass.
Result<void> check_finite(Volume& volume, std::optional<double> replacement);

}  // namespace intervale
