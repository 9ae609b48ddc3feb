// The pixels of a picture.
#pragma once

#include <cstdint>
#include <vector>

namespace intervale {

// Rows from the top; red, green and blue, a byte each, sRGB; rows without padding.
struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
  bool has_drawing = false;  // anything but background
};

}  // namespace intervale
