// Reads volumes in any supported format, and checks their samples.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/patch/volume.h"
#include "common/util/export.h"
#include "common/util/result.h"
#include "server/volume/raw_reader.h"

namespace intervale {

struct VolumeHeader;
class VolumeReader;

// What a person names: FILE:/ARRAY is an array of an HDF5 file or a Zarr folder, unless there is a file of that whole
// name or a part is chosen otherwise.
struct NamedVolume {
  std::filesystem::path path;
  std::optional<std::string> part;
};
[[nodiscard]] INTERVALE_EXPORT NamedVolume named_volume(const std::string& text, const std::optional<std::string>& part = {});

// What is in a file that describes itself: NRRD, NIfTI, MetaImage, MRC, NumPy, VTK, TIFF, DICOM or HDF5, as it begins,
// whatever its name; without that the name decides. Or in a folder: of Zarr, or with the files of a TIFF or DICOM
// volume. None: the file's samples are raw. part: which of several volumes (VolumeHeader::parts); none: the first.
[[nodiscard]] Result<std::optional<VolumeHeader>> read_volume_header(const std::filesystem::path& path, const std::optional<std::string>& part = {});

// Their names, for complaints: "NRRD, ... or Zarr".
extern const char* const kVolumeFormats;

// For a file that describes itself a layout is misuse, and so is none for any other, whose samples are raw. To choose no
// part or time point of several, or one that is not there, is misuse. part: see read_volume_header(); of a
// file with several numbers a sample which of them, from 0, or else which time point. Without a part, three numbers are a
// vector.
[[nodiscard]] Result<std::unique_ptr<VolumeReader>> open_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout,
                                                                std::optional<std::uint64_t> time_point = {},
                                                                const std::optional<std::string>& part = {});

// Likewise; the samples in a box, or all. Slope and intercept are applied. Only what is kept is in memory.
INTERVALE_EXPORT Result<Volume> read_volume(const std::filesystem::path& path, const std::optional<RawLayout>& layout,
                                            std::optional<std::uint64_t> time_point = {}, const std::optional<std::string>& part = {},
                                            const std::optional<SampleBox>& crop = {});

// What a volume in a file or a folder is called: its name, without folders and extension.
[[nodiscard]] std::string volume_name(const std::filesystem::path& path);

// The samples of one component of a volume, as a volume: component < volume.components.
[[nodiscard]] INTERVALE_EXPORT Volume component_of(const Volume& volume, unsigned component);

// Fails if a sample is NaN or infinite, and gives the (i, j, k) of the first one; a replacement, if given, is stored in
// all of them instead. A replacement that is not finite in the volume's type is misuse. first: where a crop begins.
INTERVALE_EXPORT Result<void> check_finite(Volume& volume, std::optional<double> replacement, const std::array<std::int64_t, 3>& first = {});

}  // namespace intervale
