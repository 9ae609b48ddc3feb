// The images of a DICOM study, and the series that they form.
//
// Images of one series are sorted along the normal of their planes (DICOM PS3.3, C.7.6.2.1.1: image position and
// orientation; axes of the world: L, P, S). The step from image to image need not be along the normal: a tilted gantry
// makes the affine a shear. Steps that differ are refused: GDCM and others would place the images wrongly without a word.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/util/result.h"
#include "server/volume/volume_header.h"

namespace intervale {

// To be said before GDCM reads a file: it may take memory by the file's size only, and if it ends the program by an
// assertion, the program's last words name the file.
void expect_trouble_at(const std::filesystem::path& path);
// Whether the pixels last read since forget_warnings() were not all there: GDCM fills them with zeros.
[[nodiscard]] bool lacks_pixels();
void forget_warnings();
// Takes GDCM's warnings, and the signals of crashes. Before all else.
void listen_to_gdcm();

// A file: one image, or several frames.
struct DicomImage {
  std::filesystem::path path;
  std::string series, description, modality, rescale_type;
  std::int64_t series_number = 0, instance = 0, temporal = 0, acquisition = 0;
  std::int64_t columns = 0, rows = 0, frames = 1;
  std::optional<std::array<double, 3>> position;
  std::optional<std::array<double, 6>> orientation;  // of a row, and of a column
  Vec3 spacing{1, 1, 1};                             // along a row, along a column, and that of slices that the file claims
  double slope = 1, intercept = 0;
};

// Images that belong together: of one series, size and orientation. Of one position all time points follow each other.
struct DicomSeries {
  VolumePart part;
  std::vector<DicomImage> images;
  std::size_t times = 1;
  [[nodiscard]] const DicomImage& first() const { return images.front(); }
  [[nodiscard]] std::size_t slices() const { return images.size() / times; }
  [[nodiscard]] bool has_one_scale() const {
    return std::all_of(images.begin(), images.end(),
                       [this](const DicomImage& i) { return i.slope == first().slope && i.intercept == first().intercept; });
  }
  [[nodiscard]] const DicomImage& at(std::size_t slice, std::size_t time) const { return images[slice * times + time]; }
};

// The series in a file or a folder and the folders in it, large ones first; one at least.
[[nodiscard]] Result<std::vector<DicomSeries>> dicom_series_in(const std::filesystem::path& path);

// From the places of the images. Fails if they are not evenly spaced, and says where.
[[nodiscard]] Result<Affine> affine_of(const DicomSeries& series);

}  // namespace intervale
