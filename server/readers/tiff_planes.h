// Which page of a TIFF file has the plane of each slice, channel and time point.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/util/result.h"
#include "server/readers/tiff_description.h"
#include "server/readers/tiff_pages.h"

namespace intervale {

struct Planes {
  std::uint64_t slices = 1, channels = 1, time_points = 1;
  std::string order;                 // of Described
  std::vector<std::uint64_t> pages;  // in that order; empty: page by page

  // Each less than its number.
  [[nodiscard]] std::uint64_t page_of(std::uint64_t slice, std::uint64_t channel, std::uint64_t time_point) const;
};

// Fails if the pages are not those that the description tells of, or if some planes are in other files. The message begins
// with `where`.
[[nodiscard]] Result<Planes> planes_of(const Described& described, const Pages& pages, const std::string& where);

}  // namespace intervale
