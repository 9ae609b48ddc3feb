// Draws triangles with a depth buffer, lit from the viewpoint, on a light background.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

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
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) = delete;
  ~Canvas();

  // Three corners a triangle, counterclockwise seen from outside; both sides are visible. Where two triangles coincide,
  // the one that faces the eye wins.
  void draw(std::span<const Corner> corners);

  // Fails if the graphics library ran out of memory.
  [[nodiscard]] Result<Pixels> finish();

 private:
  struct State;
  explicit Canvas(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace intervale
