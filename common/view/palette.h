// Palettes: colours for numbers, as pictures and the viewer show the values of a field.
//
// In each of them colours become steadily lighter, so that they also order numbers in grey prints, and for people with a
// colour vision deficiency.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace intervale {

class Palette {
 public:
  using Colour = std::array<double, 3>;                        // sRGB: red, green and blue, each 0 to 1
  using Bytes = std::array<std::array<std::uint8_t, 3>, 256>;  // the same, each 0 to 255
  static constexpr std::size_t kControls = 18;                 // colours that define one, at equal distances
  using Controls = std::array<std::uint32_t, kControls>;       // red << 16 | green << 8 | blue

  explicit constexpr Palette(const Controls& controls) : controls_(controls) {}

  // The colour of a number: 0 has the darkest one, 1 the lightest one; between the controls it changes linearly. Numbers
  // outside [0, 1] have the colours of its ends, and what is not a number the darkest.
  [[nodiscard]] Colour at(double t) const;
  // Those of 0, 1/255, ... and 1, rounded.
  [[nodiscard]] Bytes bytes() const;

 private:
  Controls controls_;
};

inline constexpr std::array<std::string_view, 5> kPaletteNames{"viridis", "cividis", "inferno", "ice", "grey"};

// Nothing if no palette has this name.
[[nodiscard]] std::optional<Palette> find_palette(std::string_view name);

// All names, for help and errors: "viridis, cividis, ... or grey".
[[nodiscard]] std::string palette_list();

}  // namespace intervale
