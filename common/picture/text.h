// Text in pictures, in a font of its own: no library and no file of the machine is needed.
#pragma once

#include <array>

#include <cstdint>
#include <string>
#include <string_view>

#include "common/picture/pixels.h"

namespace intervale {

// Text stands on a raster of dots: each character takes kAcross to the right, and has kDown, two of which are below the
// line.
inline constexpr int kAcross = 6, kDown = 9;

// Draws one line of UTF-8. left, top: of its first character, in pixels from the top left corner of the picture, which
// may cut it off. dot: pixels from one dot to the next, 1 or more. Characters other than ASCII and a few of units are
// boxes.
void draw_text(Pixels& pixels, std::string_view text, double left, double top, double dot, const std::array<std::uint8_t, 3>& ink);

// How many characters it has.
[[nodiscard]] int text_length(std::string_view text);

// Its first `most` characters; if it has more, the last three of them are full stops. most: at least 3.
[[nodiscard]] std::string shortened(std::string_view text, int most);

// Mixes a colour into a rectangle: 0 leaves it, 1 replaces it. Clipped to the picture.
struct Rectangle {
  int left = 0, top = 0, width = 0, height = 0;
};
void fill(Pixels& pixels, const Rectangle& rectangle, const std::array<std::uint8_t, 3>& colour, double share);

}  // namespace intervale
