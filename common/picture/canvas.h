// Draws triangles with a depth buffer, lit from the viewpoint, on a light background.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "common/picture/gl.h"
#include "common/picture/triangles.h"
#include "common/picture/viewpoint.h"
#include "common/util/result.h"

namespace intervale {

// Rows from the top; red, green and blue, a byte each, sRGB; rows without padding.
struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

// Belongs to one thread from creation to destruction.
class Canvas {
 public:
  // Draws the background. size: width and height, at least 1. Fails where OpenGL ES is missing, or the size is too
  // large for it.
  static Result<Canvas> create(const std::array<int, 2>& size, const Viewpoint& viewpoint);

  // Three corners a triangle, counterclockwise seen from outside; both sides are visible. Where two triangles coincide,
  // the one that faces the eye wins.
  void draw(std::span<const Corner> corners);

  // Fails if the graphics library ran out of memory.
  [[nodiscard]] Result<Pixels> finish();

 private:
  Canvas(GlContext context, const std::array<int, 2>& size) : context_(std::move(context)), size_(size) {}
  [[nodiscard]] Result<void> begin(const Viewpoint& viewpoint);
  [[nodiscard]] Result<void> draw_background() const;
  [[nodiscard]] Result<void> prepare(const Viewpoint& viewpoint) const;  // for draw()
  GlContext context_;
  std::array<int, 2> size_;
  GLuint drawn_ = 0;  // framebuffer
};

}  // namespace intervale
