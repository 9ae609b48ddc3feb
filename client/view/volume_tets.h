// All tetrahedra of the meshes of one or several ranges, and their order as rays to the eye meet them: what volume
// rendering draws.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "client/view/boundary_surface.h"
#include "common/util/vec3.h"

namespace intervale {

struct VolumePoint {
  float x = 0, y = 0, z = 0;  // in samples
  float value = 0;            // of the field
};
static_assert(sizeof(VolumePoint) == 16);

class VolumeTets {
 public:
  using Corners = std::array<std::uint32_t, 4>;
  // Numbers of points are less than 2^30: of the first corner the bits above tell which range it is of, 0 to 3.
  static constexpr int kRangeShift = 30;
  static constexpr std::size_t kMost = std::size_t(1) << 22;  // no more are taken: 44 bytes each, here and where they are drawn

  // The mesh of the next range, as of the surface's last update. values: of all its points (point_values.h).
  void add(const BoundarySurface& surface, std::span<const float> values);

  [[nodiscard]] const std::vector<VolumePoint>& points() const { return points_; }
  [[nodiscard]] const std::vector<Corners>& tets() const { return tets_; }  // positive in the world

  // The numbers of all tetrahedra, the farthest first: by the distances of their centres from the eye (world; finite
  // coordinates, at most 1e300), to 1/65536 of the span of all of these. Where neighbours differ much in size or shape,
  // this is not always the order in which a ray meets them. O(tetrahedra), some 20 ns for each.
  [[nodiscard]] std::vector<std::uint32_t> order(const Vec3& eye) const;

 private:
  Affine affine_;
  unsigned ranges_ = 0;  // added
  std::vector<VolumePoint> points_;
  std::vector<Corners> tets_;
  std::vector<std::array<float, 3>> centres_;  // of the tetrahedra, in samples
};

}  // namespace intervale
