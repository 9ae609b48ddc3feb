// The viewpoint of a picture, and the projection of points of the world.
#pragma once

#include <array>
#include <optional>

#include "common/mesh/plane_cut.h"
#include "common/util/vec3.h"
#include "common/view/lod.h"

namespace intervale {

// A camera that shows the whole box in 1280 x 960 pixels, in a three-quarter view from above, z up; a cut from its open
// side. The box is not a point.
[[nodiscard]] Camera three_quarter_view(const Box& box, const std::optional<Plane>& clip);

// A camera's axes, all of length 1: to the right of the picture, up in it, and towards the viewer.
struct Axes {
  Vec3 right, up, back;
};
[[nodiscard]] Axes axes_of(const Camera& camera);  // valid by check_lod

// The scene is the world moved and scaled so that the box's corners lie on the unit sphere; floats are precise enough
// there.
struct Viewpoint {
  Viewpoint(const Camera& camera, const Box& box);  // camera: valid by check_lod

  [[nodiscard]] std::array<float, 3> in_scene(const Vec3& world) const;

  Vec3 centre;                          // the scene's origin, in the world
  double unit;                          // a length of 1 in the scene, in the world
  std::array<float, 3> eye;             // in the scene
  std::array<float, 9> rotation;        // from the scene to right, up and towards the viewer; column by column, as the next
  std::array<float, 16> projection;     // from the scene to OpenGL's clip coordinates
  std::array<float, 2> nearest_to_far;  // distances ahead of the eye between which the scene lies
};

}  // namespace intervale
