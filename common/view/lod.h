// A level of detail: the error, the region, the camera and the budgets that a client asks for.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/diamond/grid.h"
#include "common/util/export.h"
#include "common/util/result.h"
#include "common/util/vec3.h"

namespace intervale {

// An axis-aligned box in world coordinates, closed: min[i] <= max[i].
struct Box {
  Vec3 min{};
  Vec3 max{};
  friend bool operator==(const Box&, const Box&) = default;
};

// The box around the samples.
[[nodiscard]] INTERVALE_EXPORT Box box_of(const Grid& grid);

// A perspective camera and the screen it fills. World coordinates.
struct Camera {
  Vec3 eye{};
  Vec3 look_at{};                           // not the eye
  Vec3 up{0, 1, 0};                         // not along the line of sight
  double fov = 45;                          // vertical, in degrees, in (0, 180)
  std::array<int, 2> viewport{1920, 1080};  // pixels, width and height, 1 to 65535 each
  double pixel_error = 1;                   // the deviation of surfaces that is allowed on the screen, in pixels; above 0
  friend bool operator==(const Camera&, const Camera&) = default;
};

// Updates are wanted where their saturated error is greater than `error` (every relevant update for error 0), inside
// `roi` if there is one, and where their deviation on the screen of `camera` is greater than its pixel error if there
// is one; everything else is only as fine as conformity needs. Budgets end refinement early, most important updates
// first.
struct Lod {
  double error = 0;                     // in the field's units, at least 0
  std::optional<double> error_percent;  // instead of `error`: 0 to 100 percent of the data set's max_error
  std::optional<Box> roi;
  std::optional<Camera> camera;
  std::optional<std::uint64_t> max_tets;     // the mesh never has more tetrahedra than this
  std::optional<std::uint64_t> max_updates;  // nor more updates than this
  friend bool operator==(const Lod&, const Lod&) = default;
};

// Misuse if a number is out of range or not finite; the message says what is valid.
[[nodiscard]] INTERVALE_EXPORT Result<void> check_lod(const Lod& lod);

// The error that a level of detail asks for, in the field's units. max_error: the data set's.
[[nodiscard]] inline double error_of(const Lod& lod, double max_error) {
  return lod.error_percent ? *lod.error_percent / 100 * max_error : lod.error;
}

}  // namespace intervale
