// An array of a Zarr folder (version 2), with what OME-Zarr 0.4 says of it.
//
// zarr-specs.readthedocs.io/en/latest/v2/v2.0.html; ngff.openmicroscopy.org/0.4. Arrays of three axes are z, y, x, those
// of four have time before them, unless `multiscales` names the axes.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

inline constexpr std::uint64_t kMostChunk = std::uint64_t(1) << 31;  // bytes; also what Blosc can hold

enum class ZarrAxis : std::uint8_t { time, channel, z, y, x };

struct ZarrArray {
  std::string name;  // its folder, from the root on: "/0"; of one of several channels with its number: "/0:1"
  std::filesystem::path folder;
  std::vector<std::uint64_t> shape, chunk;
  std::vector<ZarrAxis> axes;
  SampleType type = SampleType::u8;
  bool big_endian = false, is_fortran = false;
  std::string codec;  // of its chunks; empty: none
  char separator = '.';
  std::vector<std::byte> fill;  // one sample, in the byte order of the machine
  std::uint64_t channel = 0;
  std::vector<double> scale, translation;  // by axis
  std::string unit;

  [[nodiscard]] std::size_t axis(ZarrAxis wanted) const { return std::size_t(std::find(axes.begin(), axes.end(), wanted) - axes.begin()); }
  [[nodiscard]] std::uint64_t length(ZarrAxis wanted) const { return axis(wanted) < axes.size() ? shape[axis(wanted)] : 1; }
  [[nodiscard]] std::uint64_t samples_of_chunk() const {
    std::uint64_t samples = 1;
    for (const std::uint64_t side : chunk) samples *= side;
    return samples;
  }
};

// The arrays in a folder that are numbers with the axes of a volume, each channel by itself; perhaps none. Throws
// nlohmann::json::exception if metadata are not of the right kinds.
[[nodiscard]] Result<std::vector<ZarrArray>> zarr_arrays_in(const std::filesystem::path& root);

// Of one of them. Fails if it claims many times more than it stores. The message begins with `where`.
[[nodiscard]] Result<VolumeHeader> header_of(const ZarrArray& array, const std::string& where);

}  // namespace intervale
