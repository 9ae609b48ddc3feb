#include "common/picture/colour_bar.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/picture/text.h"

namespace intervale {
namespace {

constexpr std::array<std::uint8_t, 3> kInk{22, 26, 34}, kGround{255, 255, 255};
constexpr double kGroundShare = 0.72;

// In pixels; dot: of the text, which all distances are multiples of.
struct Layout {
  double dot;
  int margin, bar_width, bar_height, top;
  explicit Layout(const Pixels& p) : dot(std::max(1.25, std::min(0.75 * p.width, double(p.height)) / 480)) {
    margin = dots(9);
    bar_width = dots(14);
    bar_height = std::max(2, int(0.4 * p.height));
    top = (p.height - bar_height) / 2;
  }
  [[nodiscard]] int dots(double n) const { return int(std::lround(n * dot)); }
  [[nodiscard]] int width_of(const std::string& text) const { return dots(kAcross * text_length(text)); }
};

}  // namespace

void draw_colour_bar(Pixels& pixels, const Palette& palette, const ValueSpan& span, const std::string& title) {
  const Layout at(pixels);
  const std::array<std::string, 3> labels{fmt::format("{:.6g}", span.high), fmt::format("{:.6g}", span.middle()), fmt::format("{:.6g}", span.low)};
  const int right = pixels.width - at.margin, bar = right - at.bar_width, text_right = bar - at.dots(5);
  const std::string heading = shortened(title, std::max(3, int((pixels.width - 2 * at.margin) / (kAcross * at.dot))));

  const int heading_left = right - at.width_of(heading);
  int left = bar;
  for (const std::string& label : labels) left = std::min(left, text_right - at.width_of(label));
  const int pad = at.dots(5), line = at.dots(kDown + 8), ground = at.top - pad;
  fill(pixels, {left - pad, ground, right - left + 2 * pad, at.bar_height + 2 * pad}, kGround, kGroundShare);
  if (!heading.empty()) {
    const int heading_top = at.top - line;
    fill(pixels, {heading_left - pad, heading_top - pad, right - heading_left + 2 * pad, ground - heading_top + pad}, kGround, kGroundShare);
    draw_text(pixels, heading, heading_left, heading_top, at.dot, kInk);
  }
  const int border = std::max(1, at.dots(0.6));
  fill(pixels, {bar - border, at.top - border, at.bar_width + 2 * border, at.bar_height + 2 * border}, kInk, 1);
  const Palette::Bytes colours = palette.bytes();
  const int last = at.bar_height - 1;
  for (int row = 0; row <= last; ++row) fill(pixels, {bar, at.top + row, at.bar_width, 1}, colours[std::size_t(255 * (last - row) / last)], 1);
  for (int i = 0; i < 3; ++i) {
    const int row = at.top + last * i / 2;
    fill(pixels, {bar - at.dots(3), row - border / 2, at.dots(3), border}, kInk, 1);
    const double middle_of_digits = 3.5 * at.dot;
    draw_text(pixels, labels[std::size_t(i)], text_right - at.width_of(labels[std::size_t(i)]), row - middle_of_digits, at.dot, kInk);
  }
}

std::string title_of(const std::string& name, const std::string& unit) { return name + (name.empty() || unit.empty() ? "" : ", ") + unit; }

}  // namespace intervale
