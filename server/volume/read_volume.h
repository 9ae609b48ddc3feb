// Reads volumes in any supported format, and checks their samples.
#pragma once

#include <filesystem>
#include <optional>

#include "common/util/result.h"
#include "server/volume/raw_reader.h"
#include "server/volume/volume.h"
#include "server/volume/volume_header.h"

namespace intervale {

// What is in a file that describes itself: NRRD, NIfTI, MetaImage, MRC, NumPy or VTK, as it begins, whatever its
// name; without that the name decides. None: the file's samples are raw.
[[nodiscard]] Result<std::optional<VolumeHeader>> read_volume_header(const std::filesystem::path& path);

// A layout for a file that describes itself is misuse, and so is none for any other, whose samples are raw. time_point:
// see read_data.
Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout, std::optional<std::uint64_t> time_point = {});

// The samples of one component of a volume, as a volume: component < volume.components.
[[nodiscard]] Volume component_of(const Volume& volume, unsigned component);

// Fails if a sample is NaN or infinite, and gives the (i, j, k) of the first one; a replacement, if given, is stored in
// all of them instead. A replacement that is not finite in the volume's type is misuse.
Result<void> check_finite(Volume& volume, std::optional<double> replacement);

}  // namespace intervale
