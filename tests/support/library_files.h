// Files of formats that are read by libraries: minimal ones, as their specifications have them.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace intervale::testing {

// A TIFF file (version 6) with pages of u16, little endian, uncompressed. pages: width * height numbers each.
// description: of the first page; may be empty. bits: what the file says of a sample, whose bytes are 16.
[[nodiscard]] std::string tiff_file(std::uint32_t width, std::uint32_t height, const std::vector<std::vector<std::uint16_t>>& pages,
                                    const std::string& description = {}, std::uint16_t samples_a_pixel = 1);

// As ImageJ writes stacks above 4 GiB: big endian, one page, and behind its samples those of the others.
[[nodiscard]] std::string imagej_file(std::uint32_t width, std::uint32_t height, const std::vector<std::uint16_t>& numbers,
                                      const std::string& description);

// One image of a DICOM series, of i16.
struct DicomImage {
  std::string series = "1.2.3", position = "0\\0\\0", orientation = "1\\0\\0\\0\\1\\0", slope = "1", intercept = "0";
  int instance = 1;
  std::uint16_t columns = 3, rows = 2;
  std::uint16_t bits = 16;  // of those of a pixel that are stored
  std::vector<std::int16_t> pixels{};
};
[[nodiscard]] std::string dicom_file(const DicomImage& image);           // PS3.10, explicit little endian
[[nodiscard]] std::string implicit_dicom_file(const DicomImage& image);  // implicit little endian, without what PS3.10 puts before

}  // namespace intervale::testing
