// Small files of every format that volumes are read from. All hold the same samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/patch/volume.h"

namespace intervale::testing {

struct VolumeFile {
  std::string name;  // with the ending that the format's files have
  std::string bytes;
  SampleType type;  // of the samples as they are read
  Affine affine;
  std::string space;
  std::uint64_t time_point = 0, time_points = 1;  // of several, the one with those samples
  std::string after{};                            // what follows the samples, from the last place on where it is found
};

// 3 x 2 x 4 samples; that at (i, j, k) is i + 10 j - 100 k, -300 to 12.
inline constexpr std::array<std::int32_t, 3> kFileDims{3, 2, 4};
[[nodiscard]] int sample_in_file(std::size_t number);

[[nodiscard]] const std::vector<VolumeFile>& volume_files();

enum class Wrapping : std::uint8_t { gzip, zlib };
[[nodiscard]] std::string deflated(const std::string& text, Wrapping wrapping);
[[nodiscard]] std::string bzip2(const std::string& text);
[[nodiscard]] std::string base64(const std::string& bytes);

}  // namespace intervale::testing
