// The colour bar: what the colours of a picture mean.
#pragma once

#include <string>

#include "common/patch/labels.h"
#include "common/picture/pixels.h"
#include "common/picture/value_span.h"
#include "common/view/palette.h"

namespace intervale {

// Draws the palette as a column at the right of a picture, the highest value on top, with the values of its ends and its
// middle beside it and the title above, on a light ground. A title that is too long for the picture is shortened.
void draw_colour_bar(Pixels& pixels, const Palette& palette, const ValueSpan& span, const std::string& title);

// The name of a field or a channel and the unit of its values, as far as they are known: "density, HU".
[[nodiscard]] std::string title_of(const std::string& name, const std::string& unit);

}  // namespace intervale
