// PNG files.
#pragma once

#include <filesystem>

#include "common/picture/canvas.h"

namespace intervale {

// Writes a temporary file and renames it. At least one pixel.
Result<void> write_png(const std::filesystem::path& path, const Pixels& pixels);

}  // namespace intervale
