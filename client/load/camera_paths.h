// Where the clients of a load look from: pure functions of a seed and the number of a view.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/view/lod.h"

namespace intervale {

enum class Scenario : std::uint8_t {
  full,   // no camera: one view of error 0, the whole stream
  orbit,  // around the box's centre at a seeded height, the whole box in sight: one turn in 20 s
  zoom,   // from where the whole box is in sight to a seeded point on its surface and back, in 10 s
  jump,   // from anywhere outside, far or close, at any point of the box, anew with each view
};

struct CameraPath {
  Scenario scenario = Scenario::orbit;
  Box box;  // not a single point
  std::array<int, 2> viewport{1920, 1080};
  double pixel_error = 2;
  double views_per_second = 5;
  std::uint64_t seed = 0;  // a client's own: it decides angles, points and distances
};

// View number 0, 1, 2, … of the path. Equal arguments give equal levels of detail, on every machine to rounding; all of them pass check_lod.
[[nodiscard]] Lod view_of(const CameraPath& path, std::uint64_t number);

// A number that looks random, in [0, 1). Equal for equal arguments.
[[nodiscard]] double random_fraction(std::uint64_t seed, std::uint64_t number);

}  // namespace intervale
