// The cameras of the clients of a load: pure functions of a seed and the number of a view.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "common/view/lod.h"

namespace intervale {

enum class Scenario : std::uint8_t {
  full,   // no camera: one view with error 0, which is the whole stream
  orbit,  // around the centre of the box at a seeded height, with the whole box in the picture: one turn in 20 s
  zoom,   // from where the whole box is in the picture to a seeded point on its surface and back, in 10 s
  jump,   // with each view to a random place outside, far or near, looking at a random point of the box
  range,  // where an orbit begins, for all views: their ranges differ, see range_path.h
};

// Their names, in the same order.
inline constexpr std::array<std::string_view, 5> kScenarios{"full", "orbit", "zoom", "jump", "range"};

struct CameraPath {
  Scenario scenario = Scenario::orbit;
  Box box;  // not a single point
  std::array<int, 2> viewport{1920, 1080};
  double pixel_error = 2;
  double views_per_second = 5;
  std::uint64_t seed = 0;  // of one client; it determines angles, points and distances
};

// View number 0, 1, 2, … of the path. Equal arguments give equal levels of detail, up to rounding on other machines.
// check_lod accepts all of them.
[[nodiscard]] Lod view_of(const CameraPath& path, std::uint64_t number);

// A pseudo-random number in [0, 1), equal for equal arguments.
[[nodiscard]] double random_fraction(std::uint64_t seed, std::uint64_t number);

}  // namespace intervale
