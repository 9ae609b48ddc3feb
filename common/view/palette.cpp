// Every 15th of the 256 colours of published palettes, rounded to bytes; what lies between is within 7/255 of them.
//
// viridis and inferno: S. van der Walt and N. Smith, A Better Default Colormap for Matplotlib, SciPy 2015.
// cividis: J. R. Nuñez, C. R. Anderton and R. S. Renslow, Optimizing Colormaps with Consideration for Color Vision
// Deficiency to Enable Accurate Interpretation of Scientific Data, PLOS ONE 13(7), 2018.
// ice: K. M. Thyng, C. A. Greene, R. D. Hetland, H. M. Zimmerle and S. F. DiMarco, True Colors of Oceanography,
// Oceanography 29(3), 2016.
#include "common/view/palette.h"

#include <cmath>

namespace intervale {
namespace {

// clang-format off
constexpr std::array<Palette, kPaletteNames.size()> kPalettes{
    Palette({0x440154, 0x481769, 0x472a7a, 0x433d84, 0x3d4e8a, 0x355e8d, 0x2e6d8e, 0x297b8e, 0x23898e,
             0x1f978b, 0x21a585, 0x2eb37c, 0x46c06f, 0x65cb5e, 0x89d548, 0xb0dd2f, 0xd8e219, 0xfde725}),
    Palette({0x00204d, 0x002b67, 0x00356e, 0x28406c, 0x3d4a6b, 0x4d556c, 0x5b606e, 0x696b71, 0x767676,
             0x848179, 0x928d78, 0xa19976, 0xb1a573, 0xc1b26d, 0xd1bf66, 0xe2cd5c, 0xf3db4f, 0xffea46}),
    Palette({0x000004, 0x0a0722, 0x1e0c45, 0x380962, 0x510e6c, 0x69166e, 0x801f6c, 0x982766, 0xb0315b,
             0xc63d4d, 0xd94d3d, 0xe9612b, 0xf47918, 0xfa9407, 0xfcb014, 0xf8cd37, 0xf2ea69, 0xfcffa4}),
    Palette({0x040613, 0x121328, 0x1f1f3e, 0x2c2a55, 0x36356e, 0x3d4287, 0x3f519d, 0x3e61ab, 0x4072b4,
             0x4682ba, 0x5092c0, 0x5da2c5, 0x6cb2cb, 0x7fc2d2, 0x97d1d9, 0xb3dfe3, 0xcfedef, 0xeafdfd}),
    Palette({0x000000, 0x0f0f0f, 0x1e1e1e, 0x2d2d2d, 0x3c3c3c, 0x4b4b4b, 0x5a5a5a, 0x696969, 0x787878,
             0x878787, 0x969696, 0xa5a5a5, 0xb4b4b4, 0xc3c3c3, 0xd2d2d2, 0xe1e1e1, 0xf0f0f0, 0xffffff}),
};
// clang-format on

}  // namespace

Palette::Colour Palette::at(double t) const {
  const double place = t > 0 ? std::fmin(t, 1) * double(kControls - 1) : 0;  // not a number: 0
  const std::size_t i = place < double(kControls - 1) ? std::size_t(place) : kControls - 2;
  const double part = place - double(i);
  Colour colour;
  for (unsigned k = 0; k < 3; ++k) {
    const auto channel = [&](std::size_t of) { return double(controls_[of] >> (16 - 8 * k) & 255) / 255; };
    colour[k] = channel(i) * (1 - part) + channel(i + 1) * part;
  }
  return colour;
}

Palette::Bytes Palette::bytes() const {
  Bytes bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Colour colour = at(double(i) / 255);
    for (std::size_t k = 0; k < 3; ++k) bytes[i][k] = std::uint8_t(std::lround(255 * colour[k]));
  }
  return bytes;
}

std::optional<Palette> find_palette(std::string_view name) {
  for (std::size_t i = 0; i < kPaletteNames.size(); ++i) {
    if (kPaletteNames[i] == name) return kPalettes[i];
  }
  return {};
}

std::string palette_list() {
  std::string list;
  for (std::size_t i = 0; i < kPaletteNames.size(); ++i) {
    list += i == 0 ? "" : i + 1 < kPaletteNames.size() ? ", " : " or ";
    list += kPaletteNames[i];
  }
  return list;
}

}  // namespace intervale
