// What the description of a TIFF file's first page says of its pages: OME-XML (docs.openmicroscopy.org/ome-model,
// "Pixels") or what ImageJ writes. Resolutions of plain files are those of printers, and are not looked at.
#pragma once

#include <tiffio.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/util/vec3.h"

namespace intervale {

// An element of OME-XML: planes, from this one on in the order of the pages, and where they are.
struct TiffData {
  std::uint64_t slice = 0, channel = 0, time_point = 0;
  std::optional<std::uint64_t> directory;  // of the first; none: 0
  std::optional<std::uint64_t> count;      // none: 1 with a directory, else all that are there
  std::optional<std::string> other_file;   // none: this one; may be empty, if it has no name
};

struct Described {
  Vec3 spacing{1, 1, 1};
  std::string unit;
  std::uint64_t channels = 1, time_points = 1;
  std::uint64_t slices = 0;  // 0: not said
  std::uint64_t images = 1;  // of ImageJ: how many follow each other where a file has one page
  bool has_known_units = true;
  std::string order = "ZCT";   // which of slice, channel and time changes first from page to page
  std::vector<TiffData> data;  // empty: page by page
};

// Of the page that the file is at. Without a description that is known, all as it is by default.
[[nodiscard]] Described description_of(TIFF* tiff);

}  // namespace intervale
