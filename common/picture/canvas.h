// A picture being drawn: triangles with depth, lit from where they are seen, on a light background.
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

// Rows from the top, red, green and blue a byte each, sRGB; no gaps.
struct Pixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

// One thread, from its making to its end.
class Canvas {
 public:
  // The background. size: width and height, at least 1. Fails where nothing can be drawn, or not as large.
  static Result<Canvas> create(const std::array<int, 2>& size, const Viewpoint& viewpoint);
  Canvas(Canvas&&) noexcept;
  Canvas& operator=(Canvas&&) = delete;
  ~Canvas();

  // Three corners a triangle, counterclockwise seen from outside; both sides are seen. Where two triangles coincide, that which faces the eye is.
  void draw(std::span<const Corner> corners);

  // Fails if the graphics library ran out of memory on the way.
  [[nodiscard]] Result<Pixels> finish();

 private:
  struct State;
  explicit Canvas(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace intervale
