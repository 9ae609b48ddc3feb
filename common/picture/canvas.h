// Draws triangles with a depth buffer, lit from the viewpoint, on a light background.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>

#include "common/picture/gl.h"
#include "common/picture/pixels.h"
#include "common/picture/triangles.h"
#include "common/picture/viewpoint.h"
#include "common/util/result.h"
#include "common/view/palette.h"

namespace intervale {

// Belongs to one thread from creation to destruction.
class Canvas {
 public:
  // Draws the background. size: width and height, at least 1. palette: of the corners' values; without one, triangles
  // have the colours of their parts. Fails where OpenGL ES is missing, or the size is too large for it.
  static Result<Canvas> create(const std::array<int, 2>& size, const Viewpoint& viewpoint, const std::optional<Palette>& palette);

  // Three corners a triangle, counterclockwise seen from outside; both sides are visible. Where two triangles coincide,
  // the one that faces the eye wins.
  void draw(std::span<const Corner> corners);

  // Fails if the graphics library ran out of memory.
  [[nodiscard]] Result<Pixels> finish();

 private:
  Canvas(GlContext context, const std::array<int, 2>& size) : context_(std::move(context)), size_(size) {}
  [[nodiscard]] Result<void> begin(const Viewpoint& viewpoint, const std::optional<Palette>& palette);
  [[nodiscard]] Result<void> draw_background() const;
  [[nodiscard]] Result<void> prepare(const Viewpoint& viewpoint, const std::optional<Palette>& palette) const;  // for draw()
  GlContext context_;
  std::array<int, 2> size_;
  GLuint drawn_ = 0;  // framebuffer
};

}  // namespace intervale
